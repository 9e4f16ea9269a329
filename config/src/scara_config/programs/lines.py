"""The lines of a robot's program, as the files of config/programs/ have them, and its steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class MoveLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="move"):
    """``J P[n] v% FINE``: a joint move to a named position.

    ``cnt`` goes on before it has settled.
    """

    position: str
    speed_percent: Annotated[float, Meta(gt=0.0, le=100.0)]
    termination: Literal["fine", "cnt"] = "fine"


class WaitLine(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="wait"):
    """``WAIT t(sec)``."""

    wait_s: Annotated[float, Meta(ge=0.0, le=3600.0)]


class GripperLine(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="gripper"
):
    """``RO[1]=ON; WAIT RI[1]=ON`` (or OFF): switch the suction, go on when the vacuum says so."""

    value: Literal["on", "off"]


class RepeatLine(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="repeat"
):
    """``FOR .. ENDFOR``: run the lines below ``times`` times."""

    times: Annotated[int, Meta(ge=1, le=1000)]
    lines: list[MoveLine | WaitLine | GripperLine | RepeatLine]


Line = MoveLine | WaitLine | GripperLine | RepeatLine


class ProgramFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One file of config/programs/.

    Positions carry the unit in the key (``joint_1_deg``, ``joint_3_mm``).
    """

    name: Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]{0,15}\Z")]
    rsr: Annotated[int, Meta(ge=2, le=8)]
    comment: str
    positions: dict[str, dict[str, float]]
    lines: Annotated[list[Line], Meta(min_length=1)]


class MoveStep(msgspec.Struct, frozen=True):
    """A move to be started.

    It has joint positions [rad or m], a programmed speed in percent, and is FINE or not.
    """

    line: int
    target: tuple[float, ...]
    speed_percent: float
    fine: bool


class WaitStep(msgspec.Struct, frozen=True):
    """A pause of ``seconds``."""

    line: int
    seconds: float


class GripperStep(msgspec.Struct, frozen=True):
    """The suction is switched; done when the vacuum is there, or gone."""

    line: int
    on: bool


def unroll(
    lines: Sequence[Line], first: int = 1
) -> Iterator[tuple[int, MoveLine | WaitLine | GripperLine]]:
    """Yield (line number, line) in the order of execution.

    Lines are numbered as they stand in the listing, a ``repeat`` takes a number of its own.
    """
    number = first
    for line in lines:
        if isinstance(line, RepeatLine):
            for _ in range(line.times):
                yield from unroll(line.lines, number + 1)
        else:
            yield number, line
        number += count_lines([line])


def count_lines(lines: Sequence[Line]) -> int:
    """Return how many lines the listing of ``lines`` has."""
    return sum(
        1 + (count_lines(line.lines) if isinstance(line, RepeatLine) else 0) for line in lines
    )
