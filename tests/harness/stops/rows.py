"""One row for each command, setting, scene and plant: what was told, and what the robot did.

A cell is brought to the instant of the command once for each allocation of the UOP, scene and
plant. The other two settings are made there: a robot takes them at once, and they matter to no
motion before a stop. Each command is tried on a copy of the whole process (``fork``), so that all
rows of an instant begin with the same bits.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import product

import msgspec
from fanuc_emulator.tp.executor import ProgramState
from scara_config import Robot
from scara_config.set_up.kit_map import kit_map
from scara_config.stopping import ALLOCATED
from twin_controller.core.events import LinkChanged

from harness.scenes.copies import copied
from harness.scenes.truth import STANDING, standstill_since, travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files

ROBOT = "fanuc_sr6ia"
PROGRAM, OVERRIDE = "ARTICLE", 100.0
FIRST_MOVE, WAIT, SECOND_MOVE = 4, 5, 6
"""Lines of ARTICLE: to P2, a WAIT of 0.7 s, to P3."""
TO, SPEED_PERCENT = "P2", 50.0
FAST = {"real leads": 2.5, "twin leads": 0.5}
"""A joint that is so fast is in the middle of its move [rad/s]; a twin begins slowly."""
IN_WAIT_S = 0.45
"""Into the WAIT, when the robot stands and the next move is 0.25 s away."""
WATCHED_S = 1.2
"""Longer than what is left of the WAIT, and than all attempts of a stop."""
RAMP_S = 0.5
"""Longer than the robot's own ramp."""
NEVER_LED_S = 4.0
"""So long the twin moves, and the robot might follow."""
CONNECTED_S = 3.0
"""The pair is aligned by then, if it ever is."""
COMMANDS = ("STOP", "ESTOP", "PAUSE")
UOPS = ("full", "simple", "none")
SCENES = ("real leads", "twin leads", "in a WAIT", "between two moves")
PLANTS = ("ideal", "field")
SETTINGS = ((True, False), (True, False))
"""CSTOPI for ABORT, and whether *IMSTP is assigned."""
Tried = tuple[str, bool, bool]
ALL: tuple[Tried, ...] = tuple(product(COMMANDS, *SETTINGS))


class Instant(msgspec.Struct, frozen=True):
    """How a robot was set up, and where it is when the command comes."""

    uop: str
    scene: str
    plant: str
    profile: str = ""
    """What robot.yaml says of the allocation; empty: what is true."""

    def __str__(self) -> str:
        return f"{self.uop}, {self.scene}, {self.plant}"


class Row(msgspec.Struct, frozen=True):
    """What one command did.

    Attributes:
        cstopi_for_abort: As settings/ spell it.
        imstp_assigned: Likewise.
        moved: The robot moved at all until the command, by the scene's own leader.
        led: The twin led it.
        stood_s: From the command until the robot stood; None: it did not stand while watched.
        ramp_s: The same, where the person at the robot takes its HOLD away: its own ramp.
        began: After it stood it moved again.
        program: Of the robot, at the end.
        success: Whether the answer says by then that both stand.
        answer: What it says: why it is refused, or which side is not seen to stand.
        mode: At the end.
        why: The reason of the mode.
    """

    command: str
    cstopi_for_abort: bool
    imstp_assigned: bool
    moved: bool
    led: bool
    stood_s: float | None
    ramp_s: float
    began: bool
    program: str
    success: bool
    answer: str
    mode: str
    why: str


def instants() -> Iterator[Instant]:
    """Return all of them."""
    yield from (Instant(*each) for each in product(UOPS, SCENES, PLANTS))


def measure(instant: Instant, tried: Iterable[Tried] = ALL) -> list[Row]:
    """Return a row for each command and each setting at an instant.

    Args:
        instant: Where the robot is.
        tried: Command, CSTOPI for ABORT, *IMSTP assigned.

    Raises:
        CellError: The cell does not come to that instant; the text says why.
    """
    files = load_files(ROBOT, plant=instant.plant, settings={"uop": instant.uop})
    files = dataclasses.replace(files, layout=kit_map(files.layout))
    profile = profiled(files.robot, instant.profile or instant.uop)
    with VirtualCell(dataclasses.replace(files, robot=profile)) as cell:
        _connect(cell, instant)
        moved = _approach(cell, instant.scene)
        ramp = copied(lambda: _ramp(cell), float)
        return [
            copied(partial(_row, cell, command, cstopi, imstp, moved, ramp), Row)
            for command, cstopi, imstp in tried
        ]


def profiled(robot: Robot, uop: str) -> Robot:
    """Return a profile whose robot has this allocation, every means of it tried."""
    address = next(iter(robot.stopping.tried.values()))
    tried = {means: address for means in ALLOCATED[uop]}
    stopping = msgspec.structs.replace(robot.stopping, uop=uop, tried=tried)
    return msgspec.structs.replace(robot, stopping=stopping)


def _connect(cell: VirtualCell, instant: Instant) -> None:
    """Bring the links up; a pair whose profile says what is not true need not become idle."""
    if not instant.profile:
        cell.connect()
        return
    cell.put(LinkChanged(cell.clock(), "twin", True, ""))
    cell.schedule.run(CONNECTED_S)


def _approach(cell: VirtualCell, scene: str) -> bool:
    """Bring the cell to the instant; return whether the robot moved."""
    if scene == "twin leads":
        cell.twin.move_to.begin(cell.files.robot.positions_m[TO], SPEED_PERCENT, "", _unheard)
        end = cell.schedule.now + NEVER_LED_S
        while not _fast(cell, scene) and cell.schedule.now < end:
            cell.schedule.run(0.01)
        return _fast(cell, scene)
    cell.real.pendant(OVERRIDE, cell.files.program_number(PROGRAM))
    line = {"real leads": FIRST_MOVE, "in a WAIT": WAIT, "between two moves": SECOND_MOVE}[scene]
    cell.wait_whatever(lambda: cell.real.shown.program_line == line, 20.0, f"line {line}")
    if scene == "real leads":
        cell.wait_whatever(lambda: _fast(cell, scene), 5.0, "a fast joint")
    if scene == "in a WAIT":
        cell.schedule.run(IN_WAIT_S)
    return True


def _unheard(success: bool, text: str) -> None:
    """Take the answer of a move that is stopped."""


def _fast(cell: VirtualCell, scene: str) -> bool:
    return max(map(abs, cell.real.shown.velocities)) > FAST[scene]


def _ramp(cell: VirtualCell) -> float:
    """Return how long the robot needs when its own HOLD is pressed [s]."""
    begun = cell.schedule.now
    cell.real.signal("panel_hold", False)
    cell.schedule.run(RAMP_S)
    return standstill_since(cell.real.truth, begun) - begun


def _set_up(cell: VirtualCell, cstopi: bool, imstp: bool) -> None:
    """Change what somebody changes on the robot's screen System > Config."""
    robot = cell.real.robot
    settings = robot._settings
    changed = msgspec.structs.replace(settings, cstopi_for_abort=cstopi, imstp_assigned=imstp)
    robot._settings = robot._inputs._settings = changed
    cell.setup.cuts_drives = imstp and cell.setup.cuts_drives


def _row(
    cell: VirtualCell, command: str, cstopi: bool, imstp: bool, moved: bool, ramp: float
) -> Row:
    """Give the command and watch."""
    _set_up(cell, cstopi, imstp)
    begun, led = cell.schedule.now, any(d.mode_after == "TWIN_LEADS" for d in cell.decisions)
    told = cell.clock()
    reply = cell.operate(command)
    stood = None
    while cell.schedule.now < begun + WATCHED_S:
        cell.schedule.run(0.05)
        since = standstill_since(cell.real.truth, begun)
        if stood is None and cell.schedule.now - since > 0.2:
            stood = since
    began = stood is not None and travel(cell.real.truth, stood + 0.02) > 0.1
    trouble = cell.unseen(told)
    still = max(map(abs, cell.real.shown.velocities)) <= STANDING
    return Row(
        command=command,
        cstopi_for_abort=cstopi,
        imstp_assigned=imstp,
        moved=moved,
        led=led,
        stood_s=stood - begun if stood is not None and still else None,
        ramp_s=ramp,
        began=began,
        program=ProgramState(cell.real.shown.program_state).name.lower(),
        success=reply.success and not trouble,
        answer=trouble if reply.success else reply.message,
        mode=cell.mode,
        why=cell.why,
    )
