"""Which places of a program belong to the controller: its signals, its position.

The kit maps UI[n] to the flag F[n]: what a client writes is a flag, and a program may set it too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from scara_config.programs.tp.listing import Indexed, Name
from scara_config.programs.tp.values import ExecutionError, Pose, Value, as_number

from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.drives.group import MotionGroup
from fanuc_emulator.drives.planner import Planner, joint_pose, joints_of
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.gripping.vehicle import DOCKED
from fanuc_emulator.streaming.source import StreamSource
from fanuc_emulator.tp.registers import FRAMES, NO_SHIFT, Registers
from fanuc_emulator.uop import UI, UO, Outputs

_PANEL = {1: "panel_reset", 3: "panel_hold", 6: "panel_start"}
"""SI[n], the operator's panel. Source: B-83284EN/09, section 3.4."""


class Signals(NamedTuple):
    """Levels of inputs and outputs, and how an input is set.

    Attributes:
        level: Of an input by its name.
        outputs: Levels of the outputs now.
        gripper: RO[1].
        vacuum: RI[1].
        write: Sets an input.
        override: Sets the override [percent].
        now: The controller's own clock [s].
        parts: What the gripper can hold, and a vehicle that brings a pallet.
    """

    level: Callable[[str], bool]
    outputs: Callable[[], Outputs]
    gripper: Callable[[], bool]
    vacuum: Callable[[], bool]
    write: Callable[[str, bool], None]
    override: Callable[[int], None]
    now: Callable[[], float]
    parts: CellParts | None = None


def registers_of(
    signals: Signals,
    source: StreamSource,
    motion: MotionGroup,
    planner: Planner,
    config: EmulatorConfig,
) -> Registers:
    """Return the registers of a controller.

    Args:
        signals: Its own.
        source: Keeps PR[1] and R[2].
        motion: Of its axes.
        planner: Knows where the tool is.
        config: Has the frames that were taught, and says which of them are selected.
    """
    joints = planner.robot.joints
    # LPOS looks for `registers` when it is read; by then the name below is bound.
    reads: dict[str, Callable[[], Value]] = {
        "R[2]": lambda: float(source.speed_percent),
        "RO[1]": signals.gripper,
        "RI[1]": signals.vacuum,
        "JPOS": lambda: joint_pose(joints, motion.commands),
        "LPOS": lambda: tool_place(registers, planner, motion.commands),
        "PR[1]": lambda: joint_pose(joints, source.setpoint),
    }
    writes: dict[str, Callable[[Value], None]] = {
        "OVERRIDE": partial(_set_override, signals.override),
        "RO[1]": lambda on: signals.write("gripper", bool(on)),
        "PR[1]": lambda pose: source.write(joints_of(joints, pose)),
    }
    for number, name in enumerate(UI, start=1):
        reads[f"UI[{number}]"] = reads[f"F[{number}]"] = partial(signals.level, name)
        writes[f"F[{number}]"] = partial(_switch, signals.write, name)
    for number, name in _PANEL.items():
        reads[f"SI[{number}]"] = partial(signals.level, name)
    for number, name in enumerate(UO, start=1):
        reads[f"UO[{number}]"] = partial(_output, signals.outputs, name)
    parts = signals.parts
    if parts is not None:
        reads[DOCKED] = lambda: parts.docked is not None
        parts.sees_dock = lambda docked: registers.write(docked.register, docked.frame)
    registers = Registers(reads, writes, signals.now, config.frames)

    def tool() -> Pose:
        try:
            return _selected(registers, "UTOOL")
        # No tool has the number that is selected: the flange alone is known.
        except ExecutionError:
            return NO_SHIFT

    planner.tool = tool
    settings = config.settings
    for kind, number in zip(FRAMES, (settings.user_frame, settings.tool_frame)):
        registers.write(Name(f"{kind}_NUM"), float(number))
    return registers


def tool_place(registers: Registers, planner: Planner, q: Sequence[float]) -> Pose:
    """Return LPOS: where the tool that is selected is, in the frame that is.

    Raises:
        ExecutionError: One is not known.
    """
    return planner.tip_pose(q, *[_selected(registers, kind) for kind in FRAMES])


def _selected(registers: Registers, kind: str) -> Pose:
    number = as_number(registers.read(Name(f"{kind}_NUM")))
    found = registers.read(Indexed(kind, (number,))) if number else NO_SHIFT
    assert isinstance(found, Pose)
    return found


def _set_override(write: Callable[[int], None], value: Value) -> None:
    """Set the override as a program does. Source: B-83284EN/09, section 4.15.4."""
    percent = as_number(value)
    if not 1.0 <= percent <= 100.0:
        raise ExecutionError(f"an override of {percent:g} % is outside [1, 100]")
    write(round(percent))


def _switch(write: Callable[[str, bool], None], name: str, value: Value) -> None:
    write(name, bool(value))


def _output(outputs: Callable[[], Outputs], name: str) -> bool:
    return bool(getattr(outputs(), name))
