"""What the line of a motion asks for, with its numbers evaluated and in their range."""

from __future__ import annotations

import re

import msgspec

from scara_config.programs.tp.listing import Expression, Indexed, MotionLine, Name
from scara_config.programs.tp.values import ExecutionError, Memory, number

_PER_SECOND = {"mm/sec": 1.0, "cm/min": 10.0 / 60.0, "inch/min": 25.4 / 60.0}
"""Speeds along a path in mm/s."""
FASTEST_MM_S = 5000.0
"""More is a slip of the finger; our choice."""
_SECONDS = {"sec": 1.0, "msec": 1e-3}
_ACC = re.compile(r"ACC\s*(?:(\d+)|R\[(\d+)(?::[^\]]*)?\])")
_OFFSET = re.compile(r"(Offset|Tool_Offset),\s*PR\[(?:GP\d:)?(\d+)(?::[^\]]*)?\]")


class Asked(msgspec.Struct, frozen=True):
    """What a motion asks for.

    Attributes:
        kind: J, L or C.
        targets: P[n] or PR[n], in their order.
        percent: Speed of a joint motion in percent of the greatest; None: it is told otherwise.
        seconds: The motion takes so long at an override of 100 % [s].
        mm_s: Speed of the tool along its path [mm/s].
        deg_s: Speed at which the tool turns [deg/s].
        cnt: How far the corner is rounded, 0..100; None: FINE.
        acc: In percent of the usual accelerations.
        offset: PR[n] that is added in the user frame; None: nothing is.
        tool_offset: PR[n] that is added in the tool's frame.
    """

    kind: str
    targets: tuple[Indexed, ...]
    percent: float | None = None
    seconds: float | None = None
    mm_s: float | None = None
    deg_s: float | None = None
    cnt: float | None = None
    acc: float = 100.0
    offset: Indexed | None = None
    tool_offset: Indexed | None = None


def asked(line: MotionLine, memory: Memory) -> Asked:
    """Return what a motion asks for.

    Raises:
        ExecutionError: It is an arc of points (A), a speed or CNT is out of its range or in the
            wrong unit, or an option is not executed; the text names it.
    """
    if line.kind not in ("J", "L", "C"):
        raise ExecutionError(f"a motion {line.kind} is not executed, J, L and C are")
    cnt = None if line.cnt is None else _within(line.cnt, memory, "CNT", 0.0, 100.0)
    found = Asked(line.kind, line.targets, cnt=cnt)
    replace = msgspec.structs.replace
    if line.speed is None:
        found = replace(found, percent=100.0)
    else:
        found = replace(found, **_speed(line.kind, line.speed, line.unit, memory))
    for option in line.options:
        found = replace(found, **_option(option, memory))
    return found


def _speed(kind: str, speed: Expression, unit: str, memory: Memory) -> dict[str, float]:
    if unit in _SECONDS:
        return {"seconds": _within(speed, memory, "a time", 1e-3, 32000.0) * _SECONDS[unit]}
    if kind == "J":
        if unit != "%":
            raise ExecutionError(f"a joint motion has a speed in %, sec or msec, not in {unit}")
        return {"percent": _within(speed, memory, "a speed", 0.0, 100.0, " %", open_below=True)}
    if unit == "deg/sec":
        return {"deg_s": _within(speed, memory, "a speed", 0.0, 1000.0, " deg/sec", True)}
    if unit not in _PER_SECOND:
        raise ExecutionError(f"the tool has no speed in {unit}")
    factor = _PER_SECOND[unit]
    found = _within(speed, memory, "a speed", 0.0, FASTEST_MM_S / factor, f" {unit}", True)
    return {"mm_s": factor * found}


def _option(option: str, memory: Memory) -> dict[str, float | Indexed]:
    if acc := _ACC.fullmatch(option):
        given: Expression = float(acc[1]) if acc[1] else Indexed("R", (float(acc[2]),))
        return {"acc": _within(given, memory, "ACC", 1.0, 150.0)}
    if offset := _OFFSET.fullmatch(option):
        name = "offset" if offset[1] == "Offset" else "tool_offset"
        return {name: Indexed("PR", (float(offset[2]),))}
    raise ExecutionError(f"the option {option} is not executed")


def _within(
    given: Expression,
    memory: Memory,
    what: str,
    low: float,
    high: float,
    unit: str = "",
    open_below: bool = False,
) -> float:
    """Return a number that is in its range.

    Raises:
        ExecutionError: It is not.
    """
    if isinstance(given, Name):
        raise ExecutionError(f"{what} in {given.word} is not executed")
    found = number(given, memory)
    # Asked so that what is no number is outside, too.
    if not (low < found or (found == low and not open_below)) or found > high:
        bracket = "]" if open_below else "["
        raise ExecutionError(f"{what} of {found:g}{unit} is outside {bracket}{low:g}, {high:g}]")
    return found
