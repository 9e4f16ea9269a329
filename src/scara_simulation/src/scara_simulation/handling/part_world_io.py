"""The cell with its parts and the suction gripper.

It is a world that also grips, and sees touches and falls.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec
import pybullet
from scara_config import ConfigError
from scara_config.frames import NO_FRAMES, FrameTable
from scara_config.palletise import MM, Palletise
from scara_config.payload import Payload
from scara_description.vehicle import VEHICLE, with_vehicle

from scara_msgs.msg import PartEvent
from scara_simulation.handling.grip_io import PartGrip
from scara_simulation.handling.ledger import Happening, Ledger, PartView
from scara_simulation.handling.part_bodies_io import LoosePart, PartBodies, PartShown, shown
from scara_simulation.handling.suction import NozzleChange, Suction, advance, command, lose
from scara_simulation.handling.touch_watch_io import TouchWatch
from scara_simulation.world_io import World

LOOK = 4
"""Physics steps between two looks at who is near whom. Our choice: a fourth of the cost, and a
sleeping part wakes in time."""
NEAR = 0.006
"""Air between a part and the tool, or what hangs at it, in which the part is awake [m]. Our
choice."""
AHEAD = 5.0
"""... and so many times the way that the tool has made since the last look. Our choice: it may get
faster."""
TOOL_RADIUS = 0.022
"""What is widest at the tool: the flange; a held part is smaller [m]."""
TURNED = 1e-5
"""A table that has turned by less [rad] has moved no part: 2 um at the stands. Our choice."""
REST_S = 0.1
"""How long a part lies still before it sleeps [s]. Our choice."""
FRICTION_SHARE = 0.9
"""Share of dry friction that holds a sleeping part on a turning table. Our choice."""


class PartsNow(msgspec.Struct, frozen=True):
    """What is published of the parts."""

    parts: Sequence[PartShown]
    suction: Suction
    collisions: int
    drops: int
    message: str
    touches: str


class PartWorld(World):
    """A world with parts; see :class:`World` for the other arguments.

    Args:
        work: palletise.yaml.
        frames: frames.yaml: where its vehicle stands, if that has a frame.

    Raises:
        ConfigError: The URDF lacks a stand or the pallet, or no joint of ``joints`` turns the
            stands.
    """

    def __init__(
        self,
        urdf: Path,
        joints: Sequence[str],
        tool_frame: str,
        *,
        dt: float,
        gravity: float,
        work: Palletise,
        dynamics: Mapping[str, tuple[float, float]] | None = None,
        mounted: Payload | None = None,
        frames: FrameTable = NO_FRAMES,
    ) -> None:
        self._work, self._tool, self._frames = work, tool_frame, frames
        self.happened: deque[tuple[int, Happening]] = deque()
        """Step and event, until somebody takes them."""
        super().__init__(
            urdf, joints, tool_frame, dt=dt, gravity=gravity, dynamics=dynamics, mounted=mounted
        )

    def _furnished(self, text: str) -> str:
        return with_vehicle(text, self._work, self._frames)

    def _furnish(self) -> None:
        """Add the parts."""
        work, tool = self._work, self._links[self._tool]
        for name in (*work.table.stands_mm, "pallet"):
            if name not in self._links:
                raise ConfigError(f"{self._urdf}: has no link {name}, which palletise.yaml needs")
        self._table = self._joint_under(next(iter(work.table.stands_mm)))
        gripper, client = work.gripper, self._client
        self._grip_limit = gripper.reach_mm * MM, gripper.offset_mm * MM
        self._bodies = PartBodies(client, self._body, self._links, work)
        stiffness, mass = gripper.stiffness_n_mm / MM, work.parts.mass_kg
        self._grip = PartGrip(
            client, self._body, tool, self._bodies, gripper.holding_force_n, stiffness, mass
        )
        rests = {*work.table.stands_mm, "pallet", VEHICLE}
        self._touches = TouchWatch(
            client,
            self._body,
            self._links,
            self._arm,
            self._tool,
            rests,
            self._bodies,
            work.watch,
            self._dt,
        )
        self._steps = self._collisions = self._drops = 0
        self._begin()

    def _joint_under(self, link: str) -> int:
        """Return which of the movable joints carries a link.

        It is the number in the order of the world's vectors.
        """
        index = self._links[link]
        while index >= 0:
            if index in self._joints:
                return self._joints.index(index)
            # 16: the parent link; -1 is the base.
            index = self._infos[index][16]
        raise ConfigError(f"{self._urdf}: no joint turns {link}")

    def _begin(self, commanded: bool = False) -> None:
        self._suction, self._message = command(Suction(), commanded), ""
        self._ledger = Ledger(self._work.watch.drop_mm * MM)
        self._touches.reset()
        # Of the last look: they give the table's acceleration and the tool's way since then.
        self._last_turn, self._last_tool = 0.0, self.link_position(self._tool)
        # The angle at which the table was last seen turned; infinite, so that the first look
        # counts.
        self._table_at = math.inf
        self._ledger.observe(
            [self._bodies.view(part, held=False, resting=True) for part in self._bodies.parts]
        )
        self.now = self._shown()

    def reset(self, positions: Sequence[float], velocities: Sequence[float] | None = None) -> None:
        """Put the joints there and all parts back on their stands; the gripper is empty.

        The suction stays on or off: one that goes off by itself is passed on, and the real robot
        drops its part.
        """
        self._grip.let_go()
        self._bodies.reset()
        super().reset(positions, velocities)
        self._begin(self._suction.commanded)

    def mount(self, payload: Payload) -> None:
        """Hang another payload at the tool, see :meth:`World.mount`; the suction as in a reset."""
        commanded = self._suction.commanded
        super().mount(payload)
        self.grip(commanded)

    @property
    def suction(self) -> Suction:
        """State of the gripper."""
        return self._suction

    def grip(self, on: bool) -> None:
        """Switch the suction on or off."""
        self._suction = command(self._suction, on)
        self.now = self._shown()

    def lay(self, places: Mapping[str, tuple[str, Sequence[float], Sequence[float]]]) -> None:
        """Put parts on links, asleep; what is not named stays where it is.

        Args:
            places: By the part's name: the link that carries it, and the pose of the part's middle
                in that link's frame, x y z [m] and a quaternion x y z w.
        """
        for part in self._bodies.parts:
            if part.name in places:
                link, (x, y, z), (a, b, c, d) = places[part.name]
                self._bodies.lay(part, link, ((x, y, z), (a, b, c, d)))
        self._begin()

    @property
    def links(self) -> Mapping[str, int]:
        """The links on which a part may lie."""
        return self._links

    @property
    def steps(self) -> int:
        """How many steps the world has made."""
        return self._steps

    def put_parts_back(self) -> str:
        """Put all parts back on their stands; return why not, or an empty text."""
        if self._suction.held:
            return f"{self._suction.held} is held"
        self._bodies.reset()
        # As for a reset: off would be passed on.
        self._begin(self._suction.commanded)
        return ""

    def step(self, efforts: Sequence[float]) -> None:
        """Advance by one time step; see :meth:`World.step`."""
        super().step(efforts)
        self._steps += 1
        if self._suction.commanded or self._suction.held:
            # Let the suction go on, and grip or release
            gripper = self._work.gripper
            candidate = "" if self._suction.held else self._candidate()
            before = self._suction
            self._suction, change = advance(
                before, candidate, self._dt, gripper.vacuum_ms * 1e-3, gripper.release_ms * 1e-3
            )
            if change is NozzleChange.GRIP:
                part = self._part(self._suction.held)
                self._grip.hold(part)
                self._tell_of(part, PartEvent.GRIPPED, f"{part.name} was gripped")
            elif change is NozzleChange.RELEASE:
                self._grip.let_go()
                self._tell_of(
                    self._part(before.held), PartEvent.RELEASED, f"{before.held} was let go"
                )
            elif (before.closed == 0.0) != (self._suction.closed == 0.0):
                self.now = self._shown()
        for happening in self._touches.collisions(self._suction.held, self._steps):
            self._tell(happening)
        if self._steps % LOOK == 0:
            self._look()
        if self._steps % 50 == 0:
            self.now = self._shown()

    def _tell(self, happening: Happening) -> None:
        self._collisions += happening.kind == PartEvent.COLLISION
        self._drops += happening.kind == PartEvent.DROPPED
        self._message = happening.message
        self.happened.append((self._steps, happening))
        self.now = self._shown()

    def _shown(self) -> PartsNow:
        return PartsNow(
            shown(self._bodies, self._suction.held),
            self._suction,
            self._collisions,
            self._drops,
            self._message,
            self._touches.text(self._steps),
        )

    def _part(self, name: str) -> LoosePart:
        return next(part for part in self._bodies.parts if part.name == name)

    def _candidate(self) -> str:
        """Return the part whose top is near enough below the nozzle."""
        reach, offset = self._grip_limit
        x, y, z = self.link_position(self._tool)
        for part in self._bodies.parts:
            # A part near the nozzle is awake.
            if part.asleep:
                continue
            px, py, pz = self._bodies.pose(part)[0]
            if (
                math.hypot(px - x, py - y) <= offset
                and -reach <= z - pz - 0.5 * self._work.parts.height <= reach
            ):
                return part.name
        return ""

    def _look(self) -> None:
        """Wake what the tool or the table could move, let sleep what lies still.

        See what has fallen.
        """
        table = self._joints[self._table]
        angle, turn = pybullet.getJointState(self._body, table, self._client)[:2]
        x, y, z = tool = self.link_position(self._tool)
        margin = NEAR + AHEAD * math.dist(tool, self._last_tool)
        self._last_tool = tool
        kind, held = self._work.parts, self._suction.held
        radius, half = kind.radius, 0.5 * kind.height
        # What hangs at the tool reaches lower than the nozzle.
        low = z - (kind.height + self._work.task.gap_mm * MM if held else 0.0)
        # The acceleration of the turning table at 1 m from its axis [1/s^2]; 0 while it stands.
        change, self._last_turn = (turn - self._last_turn) / (LOOK * self._dt), turn
        needed = math.hypot(change, turn * turn)
        slipping = needed if needed > 0.1 else 0.0
        turned = abs(angle - self._table_at) > TURNED
        self._table_at = angle if turned else self._table_at
        views = []
        for part in self._bodies.parts:
            # A part that sleeps moves with the table alone.
            if turned or not part.asleep:
                part.centre = self._bodies.pose(part)[0]
            px, py, pz = part.centre
            aside = math.hypot(px - x, py - y) - TOOL_RADIUS - radius
            near = aside < margin and low - pz - half < margin
            if not part.asleep:
                views.append(self._attend(part, near or slipping > 0.0))
            elif near or (slipping > 0.0 and part.support in self._work.table.stands_mm):
                # Friction may not hold it on the turning table any more.
                ax, ay = self._work.table.axis_mm
                asked = math.hypot(px - ax * MM, py - ay * MM) * slipping
                if near or asked > FRICTION_SHARE * kind.friction * self._gravity:
                    self._bodies.wake(part)
        if not views:  # the ledger knows of awake parts alone
            return
        for happening in self._ledger.observe(views):
            self._tell(happening)

    def _attend(self, part: LoosePart, stay: bool) -> PartView:
        """Look after an awake part.

        Let it sleep once it lies still unless it is to ``stay`` awake, or check the grip.
        """
        if part.name == self._suction.held:
            view = self._bodies.view(part, held=True, resting=False)
            self._check_grip(part)
            return view
        part.still_for = part.still_for + LOOK * self._dt if self._bodies.settle(part) else 0.0
        resting = part.still_for >= REST_S
        view = self._bodies.view(part, held=False, resting=resting)
        if resting and not stay:
            self._bodies.put_to_sleep(part)
        return view

    def _check_grip(self, part: LoosePart) -> None:
        """Take a part off the nozzle that was pulled away from it."""
        if not self._grip.is_torn(part):
            return
        self._grip.let_go()
        self._suction = lose(self._suction)
        force = self._work.gripper.holding_force_n
        self._tell_of(
            part, PartEvent.RELEASED, f"{part.name} was torn off: the suction holds {force:g} N"
        )

    def _tell_of(self, part: LoosePart, kind: str, text: str) -> None:
        where = self._bodies.view(part, held=False, resting=False).position
        other = part.support if kind == PartEvent.GRIPPED else ""
        self._tell(Happening(kind, part.name, other, text, where))
