"""Jog velocities that wait for the real robot: it is as late as its delay, so the twin waits."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

from scara_config import Joint

from scara_control.joint_motion import JointMotion, Setpoints


class JogQueue:
    """What the joints are going to be told, by the time when they are told it."""

    def __init__(self, period: float) -> None:
        """Begin empty; velocities come each ``period`` [s]."""
        self._period = period
        self._waiting: deque[tuple[float, dict[str, float]]] = deque()
        # What the joints were told last.
        self.told: dict[str, float] = {}

    def __bool__(self) -> bool:
        """Whether anything waits."""
        return bool(self._waiting)

    def put(self, due: float, velocities: Mapping[str, float]) -> None:
        """Add velocities [rad/s or m/s] that are due [s] after all that wait."""
        if velocities:
            self._waiting.append((due, dict(velocities)))

    def take(self, now: float) -> dict[str, float]:
        """Return what is due at ``now`` [s] at the latest: the newest for each joint."""
        due: dict[str, float] = {}
        while self._waiting and self._waiting[0][0] <= now:
            due.update(self._waiting.popleft()[1])
        self.told.update(due)
        return due

    def drop(self, names: Sequence[str]) -> None:
        """Forget joints that were taken from us."""
        for name in names:
            self.told.pop(name, None)
            for _, velocities in self._waiting:
                velocities.pop(name, None)

    def clear(self) -> dict[str, float]:
        """Forget all; return what the joints were told last."""
        told, self.told = self.told, {}
        self._waiting.clear()
        return told

    def travel(self, name: str, now: float) -> float:
        """Return how far a joint goes by what it was told and what waits [rad or m]."""
        way, at, velocity = 0.0, now, self.told.get(name, 0.0)
        for due, velocities in self._waiting:
            way += velocity * (due - at)
            at, velocity = due, velocities.get(name, velocity)
        return way

    def setpoints(self, joints: Sequence[Joint], q: Sequence[float], now: float) -> Setpoints:
        """Return where the joints are going to be, within their limits.

        Args:
            joints: All joints.
            q: Where they are [rad or m].
            now: [s]
        """
        velocity = [self.told.get(joint.name, 0.0) for joint in joints]
        times, rows = [now], [velocity]
        for due, velocities in self._waiting:
            # What was told holds until a period before the next is due.
            if due - times[-1] > 1.5 * self._period:
                times.append(due - self._period)
                rows.append(velocity)
            if due - times[-1] > 0.5 * self._period:
                velocity = [velocities.get(j.name, v) for j, v in zip(joints, velocity)]
                times.append(due)
                rows.append(velocity)
        here, points = list(q), []
        for k, qdot in enumerate(rows):
            before, after = max(k - 1, 0), min(k + 1, len(rows) - 1)
            # A row that stands alone has no time around it.
            passed, around = times[k] - times[before], max(times[after] - times[before], 1e-9)
            here = [
                # A joint that is beyond a limit now is not set back to it in one step.
                min(max(x + 0.5 * (a + b) * passed, min(j.lower, was)), max(j.upper, was))
                for j, x, a, b, was in zip(joints, here, rows[before], qdot, q)
            ]
            qddot = tuple((b - a) / around for a, b in zip(rows[before], rows[after]))
            points.append(JointMotion(tuple(here), tuple(qdot), qddot, times[k]))
        return Setpoints(tuple(joint.name for joint in joints), tuple(points))

    def limit(self, joints: Sequence[Joint], percent: float) -> None:
        """Let nothing be faster than ``percent`` of its joint's largest speed any more."""
        most = {joint.name: joint.velocity * percent / 100.0 for joint in joints}
        for velocities in (self.told, *(row for _, row in self._waiting)):
            for name, velocity in velocities.items():
                velocities[name] = min(max(velocity, -most[name]), most[name])
