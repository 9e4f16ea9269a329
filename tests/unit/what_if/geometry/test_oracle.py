"""An outside oracle: MuJoCo's forward kinematics and distances on the same URDF."""

from __future__ import annotations

import os

import mujoco
import numpy as np
import pytest
from harness.yaml_files import CONFIG
from scara_config.profile import CHOICE
from what_if.geometry.scene import Press, Scene
from what_if.io.cell_files import read_cell
from what_if.world import Cell

FAR = 4.0
AGREE = 0.5e-3
"""The goal: so far [m] may the two be apart."""


class Oracle:
    """The cell in MuJoCo, from the URDF's text alone."""

    def __init__(self, cell: Cell) -> None:
        text = cell.robot.description.read_text(encoding="utf-8")
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


@pytest.mark.parametrize("robot", ["fanuc_sr6ia", "fanuc_sr3ia", "articulated_six"])
@pytest.mark.parametrize("count", [25, pytest.param(1000, marks=pytest.mark.thorough)])
def test_mujoco_finds_the_same_clearance(
    robot: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The smallest distance of all pairs that are watched, in poses all over the ranges."""
    monkeypatch.setitem(os.environ, CHOICE, robot)
    cell = read_cell(CONFIG)
    scene, oracle = Scene(cell.tree, cell.bodies, Press()), Oracle(cell)
    low, high = np.array([(j.lower, j.upper) for j in cell.robot.twin_joints]).T
    poses = np.random.default_rng(29).uniform(low, high, (count, len(low)))
    bodies = scene.body_poses(poses)
    apart, free = [], 0
    for k, q in enumerate(poses):
        oracle.pose(q)
        ours, theirs = np.inf, np.inf
        for pair in scene.pairs:
            ours = min(ours, scene.distances.between(k, bodies[k], pair.first, pair.second))
            theirs = min(theirs, oracle.distance(pair.first, pair.second))
        if ours <= 0.0 or theirs <= 0.0:
            assert ours <= AGREE and theirs <= AGREE
            continue
        free += 1
        apart.append(abs(ours - theirs))
    assert free > count // 4
    assert max(apart) <= AGREE
