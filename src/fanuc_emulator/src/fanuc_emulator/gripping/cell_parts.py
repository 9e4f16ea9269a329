"""The real side's parts: rigid bookkeeping.

A held part moves with the tool, a part on a stand with the table, others stay.

Nothing here is dynamics: a part that is let go is at once on what is below it. It is the real
side's own truth about what was placed where, as measured positions of the robot would not be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import msgspec
from scara_config import ConfigError, Robot
from scara_config.palletise import MM, Palletise

from fanuc_emulator.gripping.surroundings import VEHICLE, Surface, WorkSurfaces
from fanuc_emulator.gripping.vehicle import Docked

SUNK = 0.0005
"""What gets deeper than this [m] into something has hit it, unless the bellows gives way. Our
choice."""


class Event(msgspec.Struct, frozen=True):
    """Something happened; fields as in scara_msgs/PartEvent."""

    kind: str
    part: str
    other: str
    position: tuple[float, float, float]
    message: str


class Part(msgspec.Struct):
    """A part: middle of its underside [m], in base_link or, on a stand, with the table at 0.

    Held: from the tool.
    """

    name: str
    on: str
    x: float
    y: float
    z: float
    turns: bool = True


class CellParts:
    """All parts and the suction.

    Args:
        work: palletise.yaml.
        robot: robot.yaml.

    Raises:
        ConfigError: The robot has no closed form of its kinematics, or no table.
    """

    def __init__(self, work: Palletise, robot: Robot) -> None:
        if robot.geometry is None:
            raise ConfigError("robot.yaml: geometry: is missing, and parts follow the tool by it")
        self._work = work
        self._around = WorkSurfaces(work)
        names = [joint.name for joint in robot.joints]
        table = work.table.joint
        if table not in names:
            raise ConfigError(
                f"palletise.yaml: table.joint: robot.yaml has no {table}: remove the file"
            )
        arm = [names.index(joint.name) for joint in robot.arm_joints]
        self._columns = (*arm[:3], names.index(table))
        self._lengths = (
            robot.geometry.l1_mm * MM,
            robot.geometry.l2_mm * MM,
            robot.geometry.h_mm * MM,
        )
        # Below this height of tool or held part something can be gripped or hit.
        self._near = self._around.top + work.parts.height + work.gripper.reach_mm * MM
        self.held: Part | None = None
        self.docked: Docked | None = None
        # Told when a vehicle has docked; the robot's registers listen.
        self.sees_dock: Callable[[Docked], None] = lambda _: None
        # Joint positions and suction with which nothing changes any more.
        self._calm_with: tuple[tuple[float, ...], bool] | None = None
        self.put_back()
        self.collisions = self.drops = 0
        self.message = ""
        self.events: list[Event] = []
        self._closed = 0.0
        self._touching: set[tuple[str, str]] = set()
        self._tool, self._table = (0.0, 0.0, 0.0), 0.0

    def put_back(self) -> str:
        """Put all parts back on their stands, as somebody would by hand.

        Return why not, or an empty text.
        """
        if self.held is not None:
            return f"{self.held.name} is held"
        self._calm_with = None
        self.parts = [
            Part(start.name, start.stand, start.x, start.y, start.z)
            for start in self._work.starts()
        ]
        return ""

    def dock(self, docked: Docked | None) -> None:
        """Let a vehicle stand beside the robot; None: it leaves, and takes along what lies on it.

        What another one brings is empty.
        """
        self.docked, self._calm_with = docked, None
        if docked is not None:
            self.sees_dock(docked)
        self._around.dock(docked.dock if docked else None)
        self.parts = [part for part in self.parts if part.on != VEHICLE]

    def place(self, part: Part) -> tuple[float, float, float]:
        """Return where the middle of a part's underside is now [m]."""
        if part is self.held:
            x, y, z = self._tool
            return x + part.x, y + part.y, z + part.z
        if part.turns:
            return (*self._around.turned(part.x, part.y, self._table), part.z)
        return part.x, part.y, part.z

    def step(self, positions: Sequence[float], suction: bool, dt: float) -> None:
        """Go on for one period.

        Args:
            positions: True joint positions in the order of robot.yaml [rad or m].
            suction: The robot's output.
            dt: Period [s].
        """
        if self._calm_with == (positions, suction):
            return
        held, touching = self.held, self._touching
        q1, q2, q3, self._table = [positions[k] for k in self._columns]
        l1, l2, h = self._lengths
        self._tool = (
            l1 * math.cos(q1) + l2 * math.cos(q1 + q2),
            l1 * math.sin(q1) + l2 * math.sin(q1 + q2),
            h + q3,
        )
        low = self.place(self.held)[2] if self.held else self._tool[2]
        close = low < self._near
        self._suck(suction, dt, close)
        if close:
            self._look_for_collisions()
        elif self._touching:
            self._touching = set()
        calm = self._closed == 0.0 and self.held is held and self._touching == touching
        self._calm_with = (tuple(positions), suction) if calm else None

    def _suck(self, suction: bool, dt: float, close: bool) -> None:
        """Build vacuum over a part that closes the nozzle, or let it in."""
        gripper, held = self._work.gripper, self.held
        target = self._below_nozzle() if suction and close and held is None else None
        changing = target is not None if held is None else not suction
        self._closed = self._closed + dt if changing else 0.0
        if target is not None and self._closed >= gripper.vacuum_ms * 1e-3:
            place, before, (x, y, z) = self.place(target), target.on, self._tool
            target.x, target.y, target.z = place[0] - x, place[1] - y, place[2] - z
            target.on, target.turns = "gripper", False
            self.held, self._closed = target, 0.0
            said = f"{target.name} was gripped"
            self._tell(Event("gripped", target.name, before, place, said))
        elif held is not None and changing and self._closed >= gripper.release_ms * 1e-3:
            self._release(held)

    def _below_nozzle(self) -> Part | None:
        """Return the part whose top is near enough below the nozzle."""
        gripper, (x, y, z) = self._work.gripper, self._tool
        for part in self.parts:
            px, py, pz = self.place(part)
            gap = z - pz - self._work.parts.height
            if (
                math.hypot(px - x, py - y) <= gripper.offset_mm * MM
                and abs(gap) <= gripper.reach_mm * MM
            ):
                return part
        return None

    def _release(self, part: Part) -> None:
        """Let a part go: it lies at once on what is below it."""
        x, y, z = self.place(part)
        self.held, self._closed = None, 0.0
        self._tell(Event("released", part.name, "", (x, y, z), f"{part.name} was let go"))
        # A millimetre higher: a part that is pressed on a surface may be a little inside it.
        under = self._around.below(x, y, z + MM, self._table)
        other = self._part_below(part, x, y, z)
        height = max(
            under.height, self.place(other)[2] + self._work.parts.height if other else -math.inf
        )
        part.on, part.turns = under.name, under.turns
        part.x, part.y = self._around.turned(x, y, -self._table) if under.turns else (x, y)
        part.z = height
        fall = z - height
        if fall > self._work.watch.drop_mm * MM or other:
            self.drops += 1
            text = (
                f"{part.name} was dropped: it fell {fall / MM:.1f} mm on "
                f"{other.name if other else under.name}"
            )
            self._tell(Event("dropped", part.name, under.name, (x, y, height), text))
        else:
            self._tell(
                Event(
                    "placed",
                    part.name,
                    under.name,
                    (x, y, height),
                    f"{part.name} was placed on {under.name}",
                )
            )

    def _part_below(self, part: Part, x: float, y: float, z: float) -> Part | None:
        """Return another part on which this one would come to lie."""
        for other in self.parts:
            px, py, pz = self.place(other)
            beside = math.hypot(px - x, py - y) >= 2.0 * self._work.parts.radius
            if other is not part and not beside and pz + self._work.parts.height <= z + MM:
                return other
        return None

    def _look_for_collisions(self) -> None:
        """Report what the nozzle or a held part has run into, once until it is free again."""
        found = self._hits_of_held(self.held) if self.held else self._hits_of_nozzle()
        for pair in found - self._touching:
            self.collisions += 1
            first, second = pair
            where = self.place(self.held) if self.held else self._tool
            part = next((name for name in pair if name.startswith("part_")), "")
            self._tell(
                Event(
                    "collision",
                    part,
                    second if part == first else first,
                    where,
                    f"{first} hit {second}",
                )
            )
        self._touching = found

    def _hits_of_nozzle(self) -> set[tuple[str, str]]:
        x, y, z = self._tool
        found = {
            ("nozzle", face.name)
            for face in self._faces()
            if z < face.height - SUNK and face.carries(x, y)
        }
        give = self._work.give
        for part in self.parts:
            px, py, pz = self.place(part)
            inside = math.hypot(px - x, py - y) < self._work.parts.radius
            if inside and pz < z < pz + self._work.parts.height - give:
                found.add(("nozzle", part.name))
        return found

    def _hits_of_held(self, held: Part) -> set[tuple[str, str]]:
        x, y, z = self.place(held)
        radius, height = self._work.parts.radius, self._work.parts.height
        give = self._work.give
        found = {
            (held.name, face.name)
            for face in self._faces()
            if z < face.height - give and face.carries(x, y, radius)
        }
        for part in self.parts:
            px, py, pz = self.place(part)
            apart = part is held or math.hypot(px - x, py - y) >= 2.0 * radius
            if not apart and z < pz + height - SUNK and pz < z + height - SUNK:
                found.add((held.name, part.name))
        return found

    def _faces(self) -> list[Surface]:
        return self._around.surfaces(self._table)

    def _tell(self, event: Event) -> None:
        self.message = event.message
        self.events.append(event)
