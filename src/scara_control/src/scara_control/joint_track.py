"""A track over time: what joints shall do at any instant, through and past time-stamped points.

Times are seconds on an axis of the caller's choice; keep it short (not seconds since 1970), so that
a float resolves it.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence

from scara_control.errors import ScaraControlError
from scara_control.joint_motion import AxisMotion, JointMotion, Setpoints, Vector

_Quintic = tuple[float, float, float, float, float, float]
_Rows = tuple[Vector, ...]


class SetpointError(ScaraControlError):
    """Set points that cannot be followed.

    Their count is wrong, a value is not finite, or their times do not increase.
    """


class JointTrack:
    """Time-stamped points of n joints and the motion through and past them.

    Never changes once made.

    Before the first point: its position, at rest. Between points: the quintic that meets position,
    velocity and acceleration at both ends. After the last: constant acceleration for at most
    ``extrapolation_limit``, then a ramp to standstill, each joint with its own
    ``stop_accelerations``. Nothing is filtered: the position is as continuous from one track to the
    next as their data agree.
    """

    __slots__ = (
        "_accelerations",
        "_extrapolation_limit",
        "_positions",
        "_quintics",
        "_segment",
        "_stop",
        "_times",
        "_velocities",
    )

    def __init__(
        self,
        times: Iterable[float],
        positions: Iterable[Sequence[float]],
        velocities: Iterable[Sequence[float]],
        accelerations: Iterable[Sequence[float]],
        *,
        extrapolation_limit: float,
        stop_accelerations: Sequence[float],
    ) -> None:
        """Check and keep the points.

        Args:
            times: Due time of each point [s], strictly increasing, length m >= 1.
            positions: Shape (m, n): [rad], prismatic [m].
            velocities: Shape (m, n): [rad/s], [m/s].
            accelerations: Shape (m, n): [rad/s^2], [m/s^2].
            extrapolation_limit: How long the last point's acceleration is trusted [s].
            stop_accelerations: Shape (n,): deceleration of the ramp afterwards, positive.

        Raises:
            SetpointError: No points, a wrong count, a value that is not finite, or times that do
                not increase.
        """
        due = tuple(float(t) for t in times)
        stop = tuple(float(a) for a in stop_accelerations)
        limit = float(extrapolation_limit)
        rows = [
            _table(what, values, len(due), len(stop))
            for what, values in (
                ("positions", positions),
                ("velocities", velocities),
                ("accelerations", accelerations),
            )
        ]
        check_times(due)
        if not (limit >= 0.0 and math.isfinite(limit)):
            raise SetpointError(f"extrapolation_limit = {extrapolation_limit} s is no duration")
        if not all(a > 0.0 and math.isfinite(a) for a in stop):
            raise SetpointError(f"stop_accelerations = {stop} are not all positive")
        self._keep(due, rows[0], rows[1], rows[2], limit, stop)

    @classmethod
    def from_checked(
        cls,
        setpoints: Setpoints,
        *,
        extrapolation_limit: float,
        stop_accelerations: Sequence[float],
    ) -> JointTrack:
        """Return the track of set points that were checked already; nothing is checked or copied.

        Args:
            setpoints: Counts fit, all values are finite, times increase.
            extrapolation_limit: See the class.
            stop_accelerations: Likewise.
        """
        # Each packet of a stream makes a track: to check it a second time would cost as much again.
        track = cls.__new__(cls)
        points = setpoints.points
        track._keep(
            setpoints.times,
            tuple(point.q for point in points),
            tuple(point.qdot for point in points),
            tuple(point.qddot for point in points),
            extrapolation_limit,
            tuple(stop_accelerations),
        )
        return track

    def _keep(
        self,
        times: Vector,
        positions: _Rows,
        velocities: _Rows,
        accelerations: _Rows,
        extrapolation_limit: float,
        stop: Vector,
    ) -> None:
        """Keep what is known to be good."""
        self._times, self._stop = times, stop
        self._positions, self._velocities = positions, velocities
        self._accelerations = accelerations
        self._extrapolation_limit = extrapolation_limit
        # A segment's polynomials are computed when it is first asked for.
        self._quintics: list[tuple[_Quintic, ...] | None] = [None] * (len(times) - 1)
        # The segment that was asked for last: time mostly goes on within it.
        self._segment = 0

    @property
    def joint_count(self) -> int:
        """How many joints the points have."""
        return len(self._stop)

    @property
    def positions(self) -> _Rows:
        """Positions of the points, shape (m, n)."""
        return self._positions

    @property
    def first_time(self) -> float:
        """Due time of the first point [s]."""
        return self._times[0]

    @property
    def last_time(self) -> float:
        """Due time of the last point [s]."""
        return self._times[-1]

    @property
    def duration(self) -> float:
        """Time from the first point to the last [s]."""
        return self._times[-1] - self._times[0]

    def at(self, t: float) -> JointMotion:
        """Return the motion of all joints at time ``t``."""
        q, qdot, qddot = zip(*[self.sample_joint(k, t) for k in range(len(self._stop))])
        return JointMotion(q, qdot, qddot)

    def at_time(self, time: float) -> tuple[list[float], list[float], list[float]]:
        """Do the same as a segment of a path: ``time`` [s] counts from the first point."""
        return self.sample(self._times[0] + time)

    def sample(self, t: float) -> tuple[list[float], list[float], list[float]]:
        """Return positions, velocities and accelerations of all joints at ``t``, each (n,)."""
        samples = [self.sample_joint(column, t) for column in range(len(self._stop))]
        return [s[0] for s in samples], [s[1] for s in samples], [s[2] for s in samples]

    def sample_joint(self, column: int, t: float) -> AxisMotion:
        """Return position, velocity and acceleration of the joint in ``column`` at time ``t``."""
        times = self._times
        if t < times[0]:
            return self._positions[0][column], 0.0, 0.0
        if t >= times[-1]:
            return self._after_last(column, t - times[-1])
        segment = self._segment
        if not times[segment] <= t < times[segment + 1]:
            segment = self._segment = bisect_right(times, t) - 1
        quintics = self._quintics[segment] or self._fit(segment)
        c0, c1, c2, c3, c4, c5 = quintics[column]
        s = t - times[segment]
        return (
            c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5)))),
            c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5))),
            2.0 * c2 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)),
        )

    def polynomial(
        self, column: int, t: float
    ) -> tuple[float, float, float, tuple[float, ...]] | None:
        """Return what :meth:`sample_joint` computes at ``t``, for whoever computes it elsewhere.

        Args:
            column: Of the joint.
            t: Time [s].

        Returns:
            From when on and until when it holds [s], how long at most after that begin [s], and
            its coefficients in the time since: six of a quintic, or position, velocity and
            acceleration of the extrapolation, or of the standstill after it, which begins at ``t``
            and has no end. None before the first point and in the ramp to standstill.
        """
        times = self._times
        if t < times[0]:
            return None
        if t >= times[-1]:
            last = (
                self._positions[-1][column],
                self._velocities[-1][column],
                self._accelerations[-1][column],
            )
            age, longest = t - times[-1], self._extrapolation_limit
            if age <= longest:
                return times[-1], math.inf, longest, last
            at_rest = self._after_last(column, age)
            return (t, math.inf, math.inf, at_rest) if at_rest[1:] == (0.0, 0.0) else None
        segment = bisect_right(times, t) - 1
        quintics = self._quintics[segment] or self._fit(segment)
        return times[segment], times[segment + 1], math.inf, quintics[column]

    def _fit(self, segment: int) -> tuple[_Quintic, ...]:
        """Compute and keep the polynomials of one segment."""
        duration = self._times[segment + 1] - self._times[segment]
        start, end = segment, segment + 1
        quintics = tuple(
            _quintic(
                duration,
                (
                    self._positions[start][j],
                    self._velocities[start][j],
                    self._accelerations[start][j],
                ),
                (self._positions[end][j], self._velocities[end][j], self._accelerations[end][j]),
            )
            for j in range(len(self._stop))
        )
        self._quintics[segment] = quintics
        return quintics

    def _after_last(self, column: int, age: float) -> AxisMotion:
        """Extrapolate the last point by ``age``, then ramp down."""
        q, v, a = (
            self._positions[-1][column],
            self._velocities[-1][column],
            self._accelerations[-1][column],
        )
        limit = self._extrapolation_limit
        if age <= limit:
            return q + age * (v + 0.5 * age * a), v + age * a, a
        q += limit * (v + 0.5 * limit * a)
        v += limit * a
        stop = -math.copysign(self._stop[column], v)
        braking = min(age - limit, abs(v / stop))
        if braking < age - limit or v == 0.0:
            return q + braking * (v + 0.5 * braking * stop), 0.0, 0.0
        return q + braking * (v + 0.5 * braking * stop), v + braking * stop, stop


def _quintic(duration: float, start: AxisMotion, end: AxisMotion) -> _Quintic:
    r"""Fit :math:`\sum c_k s^k` to ``start`` at 0 and ``end`` at ``duration``."""
    q0, v0, a0 = start
    q1, v1, a1 = end
    h = duration
    # What the acceleration of the start leaves undone: of the way, the speed and the acceleration.
    step = (q1 - q0 - h * (v0 + 0.5 * h * a0)) / h**3
    speed = (v1 - v0 - h * a0) / h**2
    bend = (a1 - a0) / h
    return (
        q0,
        v0,
        0.5 * a0,
        10.0 * step - 4.0 * speed + 0.5 * bend,
        (-15.0 * step + 7.0 * speed - bend) / h,
        (6.0 * step - 3.0 * speed + 0.5 * bend) / (h * h),
    )


def _table(
    what: str, rows: Iterable[Sequence[float]], points: int, joints: int
) -> tuple[tuple[float, ...], ...]:
    """Return ``rows`` as tuples after checking their shape and that all values are finite."""
    table = tuple([tuple(map(float, row)) for row in rows])
    if points == 0:
        raise SetpointError("no points")
    if len(table) != points:
        raise SetpointError(f"{len(table)} rows of {what} for {points} times")
    for k, row in enumerate(table):
        if len(row) != joints:
            raise SetpointError(f"point {k}: {len(row)} {what} for {joints} joints")
        if not all(map(math.isfinite, row)):
            raise SetpointError(f"point {k}: {what} = {list(row)}: not finite")
    return table


def check_times(times: Sequence[float]) -> None:
    """Refuse times that are not finite or do not increase.

    Raises:
        SetpointError: Names the first point that is wrong.
    """
    for k, t in enumerate(times):
        if not math.isfinite(t):
            raise SetpointError(f"point {k}: time = {t}: not finite")
        if k and not t > times[k - 1]:
            raise SetpointError(
                f"point {k}: time {t:.6f} s is not after point {k - 1} at {times[k - 1]:.6f} s"
            )
