"""What is true of a motion, by MuJoCo's forward kinematics and distances on the same URDF.

None of the code that is judged takes part: the cell is the URDF's text with what stands in it as
further links, and a way is looked at closely, sample by sample.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import mujoco
import numpy as np
import numpy.typing as npt
from what_if.world import Obstacle, World

SAMPLE = 0.00025
"""Two bodies that are near each other are looked at each time they may have moved so far [m]."""
REACH = 1.0
"""No point moves further than this for each unit of all joints [m/rad]; both robots are smaller."""
FAR = 0.05
"""Distances beyond it [m] are not asked for."""
Pairs = Sequence[tuple[int, int]]
Vector = tuple[float, ...]
Matrix = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Thing:
    """A body of the oracle that stands in no URDF.

    Attributes:
        name: Of its link.
        parent: The link that carries it; empty: the root.
        pose: In the link's frame, shape (4, 4), translation in [m].
        shape: box, cylinder or sphere.
        size: As a :class:`what_if.world.Obstacle` has it [m].
    """

    name: str
    parent: str
    pose: Matrix
    shape: str
    size: tuple[float, ...]


class Truth:
    """The cell in MuJoCo.

    Args:
        world: The cell: parts, posts, people and zones are bodies.
        held: A part that hangs at the tool; None: none does.
    """

    def __init__(self, world: World, held: Thing | None = None) -> None:
        robot = world.cell.robot
        text = _standing(robot.description.read_text(encoding="utf-8"), world)
        self._root = world.cell.description.chain(robot.tool_frame)[0].parent
        self.held = held
        things = [*things_of(world), *([held] if held else [])]
        more = "".join(_link(thing, self._root) for thing in things)
        more += '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco>'
        self.model = mujoco.MjModel.from_xml_string(text.replace("</robot>", more + "</robot>"))
        self.data = mujoco.MjData(self.model)
        self._at = [self.model.joint(joint.name).qposadr[0] for joint in robot.twin_joints]
        self.names = [self.model.body(int(k)).name for k in self.model.geom_bodyid]
        self.ranges = np.array([self.model.joint(j.name).range for j in robot.twin_joints])
        chain = [joint.child for joint in world.cell.description.chain(robot.tool_frame)]
        moving = {*chain[chain.index("link_1") :], *([held.name] if held else [])}
        self.arm = [k for k, name in enumerate(self.names) if name in moving]
        zones = {f"zone_{zone.name}" for zone in world.zones}
        foreign = {f"post_{thing.name}" for thing in world.obstacles} | {
            f"person_{k}" for k in range(len(world.people))
        }
        others = [k for k, name in enumerate(self.names) if name not in moving]
        foot = {"world", self._root}
        self.zones = [(k, o) for k in self.arm for o in others if self.names[o] in zones]
        self.bodies = [
            (k, o)
            for k in self.arm
            for o in others
            if self.names[o] not in zones
            and not (self.names[k] == "link_1" and self.names[o] in foot)
        ]
        self.own = [
            (k, o) for k in self.arm for o in self.arm if self._joints(o) - self._joints(k) > 1
        ]
        carried = [k for k in others if self._joints(k) and self.names[k] not in zones]
        self.table = [(k, o) for k in carried for o in others if self.names[o] in foreign]

    def _joints(self, geom: int) -> int:
        """Return how many joints lie between the root and a shape."""
        body, count = int(self.model.geom_bodyid[geom]), 0
        while body:
            count += int(self.model.body_jntnum[body])
            body = int(self.model.body_parentid[body])
        return count

    def pose(self, q: Sequence[float]) -> None:
        """Put the joints there."""
        self.data.qpos[self._at] = q
        mujoco.mj_kinematics(self.model, self.data)

    def joints(self) -> Matrix:
        """Return where the joints are, shape (n,)."""
        found: Matrix = self.data.qpos[self._at].copy()
        return found

    def link(self, name: str) -> Matrix:
        """Return the pose of a link in the root, shape (4, 4)."""
        body, pose = self.data.body(name), np.eye(4)
        pose[:3, :3], pose[:3, 3] = body.xmat.reshape(3, 3), body.xpos
        return pose

    def clearance(self, pairs: Pairs) -> float:
        """Return the smallest distance of these pairs [m], at most ``FAR``."""
        ask, model, data = mujoco.mj_geomDistance, self.model, self.data
        rows = np.array(pairs)
        if not rows.size:
            return FAR
        # MuJoCo's own spheres around the shapes leave few pairs to be asked for.
        apart = np.linalg.norm(data.geom_xpos[rows[:, 0]] - data.geom_xpos[rows[:, 1]], axis=1)
        apart -= model.geom_rbound[rows].sum(axis=1)
        near = rows[apart < FAR].tolist()
        return min((ask(model, data, one, other, FAR, None) for one, other in near), default=FAR)

    def at(self, q: Sequence[float], pairs: Pairs) -> float:
        """Return the smallest distance of these pairs with the joints there [m]."""
        self.pose(q)
        return self.clearance(pairs)

    def keeps_off(
        self, start: Sequence[float], end: Sequence[float], pairs: Pairs, far: float
    ) -> bool:
        """Return whether these pairs stay ``far`` [m] from each other on a straight way.

        From each place the next one is as far as half of what is left would last, or ``SAMPLE``.
        """
        a, b = np.array(start), np.array(end)
        length = max(REACH * float(np.abs(b - a).sum()), SAMPLE)
        along = 0.0
        while along < length:
            left = self.at(a + along / length * (b - a), pairs) - far
            if left < 0.0:
                return False
            along += max(SAMPLE, 0.5 * left)
        return self.at(b, pairs) >= far

    def against(self, *links: str) -> Pairs:
        """Return the pairs of the arm with these links."""
        return [pair for pair in self.bodies if self.names[pair[1]] in links]

    def inside(self, links: Sequence[str], rng: np.random.Generator) -> Vector:
        """Return a point in or beside a random shape of these links [m]."""
        outer = [k for k, name in enumerate(self.names) if name in links]
        k = int(rng.choice(outer))
        aside = rng.normal(size=3)
        aside *= float(rng.uniform(0.0, self.model.geom_rbound[k])) / np.linalg.norm(aside)
        x, y, z = (self.data.geom_xpos[k] + aside).tolist()
        return x, y, z


def things_of(world: World) -> list[Thing]:
    """Return what stands in a world beside what its URDF holds; zones are boxes."""
    cell, config = world.cell, world.cell.config
    found = []
    if cell.work is not None:
        size = (cell.work.parts.radius, cell.work.parts.height)
        found += [Thing(p.name, p.link, p.pose, "cylinder", size) for p in world.parts]
    found += [_obstacle(thing) for thing in world.obstacles]
    floor, height = cell.floor, config.person_height_mm * 1e-3
    height -= 0.0 if cell.work else floor
    for k, (x, y, _) in enumerate(world.people):
        size = (config.person_radius_mm * 1e-3, height)
        found.append(Thing(f"person_{k}", "", _at((x, y, floor + 0.5 * height)), "cylinder", size))
    for zone in world.zones:
        low, high = 1e-3 * np.array(zone.lower_mm), 1e-3 * np.array(zone.upper_mm)
        sides = tuple((high - low).tolist())
        found.append(Thing(f"zone_{zone.name}", "", _at(0.5 * (low + high)), "box", sides))
    return found


def _standing(text: str, world: World) -> str:
    """Return the URDF's text with each joint's frame where it is in this world."""
    tree = ElementTree.fromstring(text)
    for frame in world.cell.description.joints:
        origin = tree.find(f"joint[@name='{frame.name}']/origin")
        if origin is not None:
            origin.set("xyz", " ".join(map(repr, map(float, frame.xyz))))
            origin.set("rpy", " ".join(map(repr, map(float, frame.rpy))))
    return ElementTree.tostring(tree, encoding="unicode")


def _obstacle(thing: Obstacle) -> Thing:
    return Thing(f"post_{thing.name}", "", _at(thing.middle), thing.shape, thing.size)


def _at(xyz: Iterable[float]) -> Matrix:
    pose = np.eye(4)
    pose[:3, 3] = list(xyz)
    return pose


def _link(thing: Thing, root: str) -> str:
    """Return a thing as a link of the URDF, fixed to what carries it."""
    words = {
        "box": 'box size="{} {} {}"',
        "cylinder": 'cylinder radius="{}" length="{}"',
        "sphere": 'sphere radius="{}"',
    }
    shape = words[thing.shape].format(*map(repr, map(float, thing.size)))
    turn = thing.pose[:3, :3]
    pitch = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
    roll, yaw = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
    xyz, rpy = (" ".join(map(repr, map(float, v))) for v in (thing.pose[:3, 3], (roll, pitch, yaw)))
    return (
        f'<link name="{thing.name}"><collision><geometry><{shape}/></geometry></collision></link>'
        f'<joint name="{thing.name}_joint" type="fixed"><origin xyz="{xyz}" rpy="{rpy}"/>'
        f'<parent link="{thing.parent or root}"/><child link="{thing.name}"/></joint>\n'
    )
