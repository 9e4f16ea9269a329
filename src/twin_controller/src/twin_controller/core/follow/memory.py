"""What is remembered while one side follows the other."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import RobotSetpoint
from twin_controller.core.events import Joints
from twin_controller.core.follow.blend import Blend
from twin_controller.core.follow.remembered import Remembered
from twin_controller.core.follow.response import Response
from twin_controller.core.sides.change import ChangeState


class TwinFollows(msgspec.Struct, frozen=True):
    """The twin follows the real robot."""

    # Nothing is sent before [s]: just after a stop the twin ignores set points.
    since: float
    # The pair aligns: a gap is closed slowly, however small it is.
    slowly: bool = False
    # What is left of the gap at the start; None until the first set point is sent.
    blend: Blend | None = None
    # Since when its set points lead to one place; begins as the twin itself stands.
    told: ChangeState = ChangeState()


class RealFollows(msgspec.Struct, frozen=True):
    """The real robot follows the twin."""

    # When the twin's motion begins, by its announcement [s]; a robot that moved before was first.
    onset: float | None = None
    # What is left of the gap real - twin at the start; None until the first set point.
    blend: Blend | None = None
    # Set points that were sent, by their time: the last one that can no longer be changed, and
    # those ahead. Empty before the first.
    told: tuple[RobotSetpoint, ...] = ()
    # Delay [s] and smoothing [s^2] of each joint that the last set point reckoned with: they follow
    # what is measured bit by bit, or the set points would jump.
    delay: Joints = ()
    smoothing: Joints = ()
    # Why one of those that still count was slowed down; empty if none was.
    slowed: str = ""
    # After a pause: the twin goes on once the robot has come to where it stands.
    resumes: bool = False

    @property
    def held(self) -> bool:
        """Whether the set point that the robot has now is not the one that was asked for."""
        return bool(self.told) and self.told[0].q != self.told[0].asked

    @property
    def last(self) -> RobotSetpoint | None:
        """The last set point; None before the first."""
        return self.told[-1] if self.told else None


class Follow(msgspec.Struct, frozen=True):
    """Who follows whom, and how; at most one side does."""

    # How the real robot answers its set points, measured while it follows.
    response: Response
    # Each ends with the lead that it belongs to; a pause keeps it.
    twin: TwinFollows | None = None
    real: RealFollows | None = None
    # What the real robot did before: it repeats its programs.
    remembered: Remembered = Remembered()
    # When the twin was told to stop last [s].
    twin_stopped_at: float = -1e9

    @property
    def slowed(self) -> str:
        """Why the last set point for the real robot was slowed down; empty if it was not."""
        if self.real is None:
            return ""
        return self.real.slowed
