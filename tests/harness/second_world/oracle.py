"""Clearance by an outside library, body by body: MuJoCo's distances on the same URDF."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scara_config.frames import find_frames
from scara_description.vehicle import with_vehicle
from what_if.geometry.scene import Press, Scene
from what_if.world import Cell

from harness.yaml_files import CONFIG

FAR = 4.0
"""No two bodies of a cell are further apart [m]."""


class Oracle:
    """The cell in MuJoCo, from the URDF's text alone."""

    def __init__(self, cell: Cell) -> None:
        text = cell.robot.description.read_text(encoding="utf-8")
        if cell.work is not None:
            text = with_vehicle(text, cell.work, find_frames(CONFIG))
        keep = '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco>'
        self.model = mujoco.MjModel.from_xml_string(text.replace("</robot>", f"{keep}</robot>"))
        self.data = mujoco.MjData(self.model)
        self._at = [self.model.joint(joint.name).qposadr[0] for joint in cell.robot.twin_joints]
        used: dict[str, int] = {}
        self.geoms = []
        for body in cell.bodies:
            number = used.get(body.link, 0)
            used[body.link] = number + 1
            self.geoms.append(self._geom(cell, body.link, number))

    def _geom(self, cell: Cell, link: str, number: int) -> int:
        """Return MuJoCo's number of a link's n-th shape; its root is called world."""
        name = "world" if link == cell.tree.links[0] else link
        names = {self.model.body(k).name: k for k in range(self.model.nbody)}
        body = self.model.body(names.get(link, names[name]))
        return int(body.geomadr[0]) + number

    def pose(self, q: np.ndarray) -> None:
        """Put the joints there."""
        self.data.qpos[self._at] = q
        mujoco.mj_kinematics(self.model, self.data)

    def distance(self, first: int, second: int) -> float:
        """Return the distance of two of our bodies [m]."""
        one, other = self.geoms[first], self.geoms[second]
        return float(mujoco.mj_geomDistance(self.model, self.data, one, other, FAR, None))


@dataclass(frozen=True)
class Compared:
    """Clearances of two libraries in the same poses.

    Attributes:
        free: In so many poses no two bodies touch, by both of them.
        apart: The largest difference of the smallest distance there [m].
        deeper: Where one says that bodies touch, the other says at most so much [m].
    """

    free: int
    apart: float
    deeper: float


def compare(cell: Cell, count: int, seed: int = 29) -> Compared:
    """Compare the smallest distance of all watched pairs, in poses all over the ranges."""
    scene, oracle = Scene(cell.tree, cell.bodies, Press()), Oracle(cell)
    low, high = np.array([(j.lower, j.upper) for j in cell.robot.twin_joints]).T
    poses = np.random.default_rng(seed).uniform(low, high, (count, len(low)))
    bodies = scene.body_poses(poses)
    free, apart, deeper = 0, 0.0, 0.0
    for k, q in enumerate(poses):
        oracle.pose(q)
        pairs = [(pair.first, pair.second) for pair in scene.pairs]
        ours = min(scene.distances.between(k, bodies[k], *pair) for pair in pairs)
        theirs = min(oracle.distance(*pair) for pair in pairs)
        if min(ours, theirs) <= 0.0:
            deeper = max(deeper, ours, theirs)
            continue
        free += 1
        apart = max(apart, abs(ours - theirs))
    return Compared(free, apart, deeper)
