"""What a robot's program makes the robot do, one thing after the other."""

from __future__ import annotations

import msgspec


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


Step = MoveStep | WaitStep | GripperStep
