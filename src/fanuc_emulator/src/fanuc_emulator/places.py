"""Which places of a program belong to the controller: its signals, its position.

The kit maps UI[n] to the flag F[n]: what a client writes is a flag, and a program may set it too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from scara_config import Joint
from scara_config.programs.tp.values import ExecutionError, Pose, Value

from fanuc_emulator.tp.registers import AXES
from fanuc_emulator.uop import UI, UO, Outputs

_PANEL = {1: "panel_reset", 3: "panel_hold", 6: "panel_start"}
"""SI[n], the operator's panel. Source: B-83284EN/09, section 3.8."""


def signal_reads(
    level: Callable[[str], bool], outputs: Callable[[], Outputs]
) -> dict[str, Callable[[], Value]]:
    """Return what stands in UI, F, SI and UO.

    Args:
        level: Of an input by its name.
        outputs: Levels of the outputs now.
    """
    found: dict[str, Callable[[], Value]] = {}
    for number, name in enumerate(UI, start=1):
        found[f"UI[{number}]"] = found[f"F[{number}]"] = partial(level, name)
    for number, name in _PANEL.items():
        found[f"SI[{number}]"] = partial(level, name)
    for number, name in enumerate(UO, start=1):
        found[f"UO[{number}]"] = partial(_output, outputs, name)
    return found


def signal_writes(write: Callable[[str, bool], None]) -> dict[str, Callable[[Value], None]]:
    """Return what setting a flag does that is mapped to an input."""

    def switch(name: str, value: Value) -> None:
        write(name, bool(value))

    return {f"F[{number}]": partial(switch, name) for number, name in enumerate(UI, start=1)}


def _output(outputs: Callable[[], Outputs], name: str) -> bool:
    return bool(getattr(outputs(), name))


def joint_pose(joints: Sequence[Joint], positions: Sequence[float]) -> Pose:
    """Return joint positions [rad or m] as a register holds them: J1, J2 .. by axis number."""
    values = [0.0] * AXES
    for joint, position in zip(joints, positions):
        values[joint.axis_number - 1] = position / joint.scale
    return Pose(tuple(values))


def joints_of(joints: Sequence[Joint], pose: Value) -> tuple[float, ...]:
    """Return what a register holds as joint positions [rad or m].

    Raises:
        ExecutionError: It is no position in joints.
    """
    if not isinstance(pose, Pose) or pose.config is not None:
        raise ExecutionError("PR[1] is followed in joints alone")
    return tuple(pose.values[joint.axis_number - 1] * joint.scale for joint in joints)
