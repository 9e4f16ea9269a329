"""A path driven along a time grid: announced, stepped, looked ahead."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from scara_config import Joint

from scara_control.config import MotionConfig
from scara_control.joint_motion import JointMotion
from scara_control.motion.plan import Path
from scara_control.motion.time_scaling import SAME_TIME, ScaleBounds, TimeBase, advance, motion_at

_LONGEST_DELAY, _LONGEST_AHEAD = 0.5, 0.5
"""No follower is believed to be later, or to take set points further ahead [s]: they would look
ahead for ever."""
_RESET_S = 1.0
"""A clock that goes back by less is a loop that was held; our choice: a loop that is 0.2 s late
begins its grid anew."""


def went_back(before: float, now: float) -> bool:
    """Say whether the clock went back: no time of before comes in due time."""
    return now < before - _RESET_S


Scale = Callable[[float], float]
"""How fast a path shall be driven at a time [s]: a part of its speed."""


@dataclass(frozen=True, slots=True)
class Follower:
    """Who does what the joints do, as well as it can.

    Attributes:
        delay: So late it does what it is told [s].
        ahead: So far ahead of their time it takes what it is told [s].
    """

    delay: float = 0.0
    ahead: float = 0.0


ALONE = Follower()


def believed(delay: float, ahead: float) -> Follower:
    """Return the follower as far as what is said of it is believed [s]."""
    return Follower(_within(delay, _LONGEST_DELAY), _within(ahead, _LONGEST_AHEAD))


def _within(value: float, most: float) -> float:
    return min(max(value, 0.0), most) if math.isfinite(value) else 0.0


@dataclass(frozen=True, slots=True)
class Drive:
    """A path being driven, at one point of the time grid.

    Never changes: :meth:`step` returns the next.

    Attributes:
        path: Where it leads.
        time: When it is here [s].
        go_at: When the first motion is due [s]; until then it stands at the start.
        base: Path time, scale and rate at ``time``.
    """

    path: Path
    time: float
    go_at: float
    base: TimeBase

    @property
    def motion(self) -> JointMotion:
        """The joints' motion at ``time``."""
        return motion_at(self.path, self.base)

    @property
    def announcing(self) -> bool:
        """Whether it waits for ``go_at``."""
        return self.time < self.go_at - SAME_TIME

    @property
    def done(self) -> bool:
        """Whether the end of the path is reached."""
        return not self.announcing and self.base.tau >= self.path.duration

    @property
    def frozen(self) -> bool:
        """Whether the scale is 0, so that nothing moves until it is raised."""
        return self.base.scale == 0.0 and self.base.rate == 0.0

    def step(self, dt: float, wanted: float, bounds: ScaleBounds, joints: Sequence[Joint]) -> Drive:
        """Return this drive ``dt`` later; see :func:`advance`."""
        time = self.time + dt
        if self.announcing:
            # Nothing moves yet, so the scale needs no ramp.
            return Drive(self.path, time, self.go_at, TimeBase(0.0, wanted))
        base = advance(self.path, self.base, wanted, bounds, joints, dt)
        return Drive(self.path, time, self.go_at, base)


class PathDriver:
    """At most one drive, and the time of the grid."""

    def __init__(self, joints: Sequence[Joint], config: MotionConfig, now: float) -> None:
        """Start without a drive, the grid at ``now``."""
        self._joints = tuple(joints)
        self._period = config.period
        self._move = config.move
        self._bounds = ScaleBounds(config.move.time_scale_ramp, config.move.time_scale_jerk)
        self.time = now
        self.drive: Drive | None = None
        # Set points look ahead as far as it needs to be told them.
        self.follower = ALONE

    @property
    def _horizon(self) -> int:
        """How far set points look ahead, in periods."""
        needed = self.follower.delay + self.follower.ahead
        return round((needed + self._move.horizon) / self._period)

    def start(self, path: Path, go_at: float, scale: float) -> None:
        """Drive a new path from now on."""
        self.drive = Drive(path, self.time, go_at, TimeBase(0.0, scale))

    def announced(self, now: float) -> float:
        """Return the first time of the grid at which a move asked for at ``now`` may begin."""
        after = now + self.follower.delay + self._move.announce - self.time
        # Rounding must not add a whole period.
        return self.time + math.ceil(after / self._period - SAME_TIME) * self._period

    def is_spent(self, now: float) -> bool:
        """Say whether all set points that were sent are past: nobody has gone on for so long."""
        return now - self.time > self._horizon * self._period

    def is_past(self, now: float) -> bool:
        """Say whether the grid is past ``now``: a request went on while the loop was held."""
        return now < self.time - SAME_TIME

    def advance(self, now: float, scale: Scale) -> None:
        """Go on to ``now``.

        A stall longer than the horizon delays the drive, so that the joints do not jump.
        """
        steps = max(math.floor((now - self.time) / self._period + SAME_TIME), 0)
        for _ in range(min(steps, self._horizon)):
            self.drive = self.drive and self._step(self.drive, scale(self.drive.time))
        late = max(steps - self._horizon, 0) * self._period
        if late and self.drive is not None:
            self.drive = replace(
                self.drive, time=self.drive.time + late, go_at=self.drive.go_at + late
            )
        self.time += steps * self._period

    def ahead(self, drive: Drive, scale: Scale) -> list[Drive]:
        """Return the drive at each time of the grid from now to the horizon, or to its end."""
        drives = [drive]
        while len(drives) <= self._horizon and not drives[-1].done:
            drives.append(self._step(drives[-1], scale(drives[-1].time)))
        return drives

    def _step(self, drive: Drive, scale: float) -> Drive:
        """Return the drive one period later."""
        return drive.step(self._period, scale, self._bounds, self._joints)
