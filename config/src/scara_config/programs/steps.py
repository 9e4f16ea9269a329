"""What a robot's program makes the robot do, one thing after the other."""

from __future__ import annotations

import msgspec


class MoveStep(msgspec.Struct, frozen=True):
    """A move to be started.

    Attributes:
        line: Its number.
        target: Joint positions [rad or m].
        speed_percent: Programmed speed.
        fine: The next line waits until the motors are there.
        cnt: How far the corner to the next motion is rounded, 0..100, where it is not FINE.
        seconds: It takes so long at an override of 100 % [s]; None: by its speed.
        acc_percent: Of the usual acceleration.
    """

    line: int
    target: tuple[float, ...]
    speed_percent: float
    fine: bool
    cnt: float = 0.0
    seconds: float | None = None
    acc_percent: float = 100.0


class WaitStep(msgspec.Struct, frozen=True):
    """A pause of ``seconds``."""

    line: int
    seconds: float


class GripperStep(msgspec.Struct, frozen=True):
    """The suction is switched; done when the vacuum is there, or gone."""

    line: int
    on: bool


Step = MoveStep | WaitStep | GripperStep
