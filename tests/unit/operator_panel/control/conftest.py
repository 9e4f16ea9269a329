"""A desk with two operators and a viewer, and a cell that remembers what it was asked."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Mapping
from typing import Any

import pytest
from harness.workspace import ROOT
from operator_panel.config import ToolSpeeds
from operator_panel.control import desk_io as desk_module
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import PageDesk
from operator_panel.control.jog import DeadMan
from operator_panel.control.tool_jog import ToolArm
from operator_panel.door import Answer
from operator_panel.view.snapshot import CellState, Snapshot
from scara_config import load_robot
from scara_ros.names import Seat

from scara_description.urdf import parse_urdf

ROBOT = load_robot(ROOT / "config")
SPEEDS = ToolSpeeds(slow_mm_s=10.0, fast_mm_s=80.0, slow_deg_s=2.0, fast_deg_s=15.0)
LIMIT_PERCENT = 10.0
KEEP_S, LET_GO_S = 5.0, 30.0


def arm_of(name: str) -> ToolArm:
    """Return an arm of the repository."""
    robot = load_robot(ROOT / "config" / "robots" / name)
    model = parse_urdf(robot.description.read_text(encoding="utf-8"))
    return ToolArm(robot, model, SPEEDS, LIMIT_PERCENT)


SCARA, SIX = arm_of("fanuc_sr6ia"), arm_of("articulated_six")
FOUR = arm_of("scara_4axis")


class Door:
    """A cell that obeys who holds control and remembers; TAKE takes what nobody holds."""

    def __init__(self) -> None:
        self.holder = self.asker = ""
        self.asked: list[tuple[str, str, bool]] = []
        self.mode = "IDLE"
        self.commands: list[str] = []
        self.when: list[float] = []
        self.jogs: list[dict[str, float]] = []
        self.position: dict[str, float] = {}

    def snapshot(self) -> Snapshot:
        """Return a state that is never silent."""
        refused = "" if self.mode in ("IDLE", "TWIN_LEADS") else "only while both stand ready"
        state = CellState(
            self.mode,
            name=tuple(self.position),
            twin_position=tuple(self.position.values()),
            command=("JOG",),
            refused=(refused,),
            holder=self.holder,
            asker=self.asker,
            not_in_control=f"{self.holder or 'nobody'} holds control",
        )
        return Snapshot(master=True, state=state, received=math.inf)

    async def command(self, seat: Seat, command: str, **fields: Any) -> Answer:
        """Remember what the holder commands."""
        self.when.append(fields["asked"])
        if seat.name != self.holder and command != "PAUSE":
            return Answer(False, f"{self.holder} holds control")
        self.commands.append(command)
        return Answer(True, "done")

    async def control(self, seat: Seat, action: str, moves: bool) -> Answer:
        """Remember; the rules are the twin controller's and are tested there."""
        self.asked.append((seat.name, action, moves))
        if action == "TAKE" and not self.holder:
            self.holder = seat.name
        if action == "RELEASE" and self.holder == seat.name:
            self.holder = ""
        return Answer(self.holder == seat.name or action not in ("TAKE", "KEEP"), action)

    def stop(self, seat: Seat, command: str) -> Awaitable[Answer]:
        """Remember."""
        self.commands.append(command)

        async def answer() -> Answer:
            return Answer(True, "stopped", {"confirmed": True})

        return answer()

    def jog(self, velocities: Mapping[str, float]) -> None:
        """Remember."""
        self.jogs.append(dict(velocities))


@pytest.fixture
def door() -> Door:
    """Give a cell."""
    return Door()


@pytest.fixture
def desk(door: Door) -> PageDesk:
    """Give a desk with two operators, a and b, and a viewer v; a is in control by a command."""
    dead_man = DeadMan(ROBOT, 10.0, 0.25)
    made = PageDesk(door, dead_man, SCARA, KEEP_S, LET_GO_S, 0.6, lambda _: None)  # type: ignore[arg-type]
    for page, role in (("a", Role.OPERATOR), ("b", Role.OPERATOR), ("v", Role.VIEWER)):
        made.open(page, role)
        made.arrived(page, f"tab {page}")
    signs(made)
    assert door.asked == [] and door.holder == "", "who only looks says nothing"
    assert command(made, "a", "SPEED").success
    door.commands.clear()
    return made


class Clock:
    """The monotonic time of the desk."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Begin now."""
        self.now = desk_module.time.monotonic()
        monkeypatch.setattr(desk_module.time, "monotonic", lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Give the time into a test's hand."""
    return Clock(monkeypatch)


def signs(desk: PageDesk) -> None:
    """Let all pages give their sign of life."""
    asyncio.run(desk.give_signs())


def command(desk: PageDesk, page: str, name: str) -> Answer:
    """Send a command."""
    return asyncio.run(desk.command(page, name))


def stop(desk: PageDesk, page: str, name: str = "STOP") -> Answer:
    """Press a stop."""

    async def press() -> Answer:
        return await desk.stop(page, name)

    return asyncio.run(press())
