"""Set points with time stamps, as they come in and go out."""

from __future__ import annotations

from dataclasses import dataclass

from scara_control.motion.plan import JointMotion


@dataclass(frozen=True, slots=True)
class SetpointPacket:
    """Set points of the joints ``names``; point k is due at ``times[k]`` [s], strictly increasing."""

    names: tuple[str, ...]
    times: tuple[float, ...]
    points: tuple[JointMotion, ...]

    def select(self, names: tuple[str, ...]) -> SetpointPacket:
        """Return the same points of only some joints."""
        columns = [self.names.index(name) for name in names]

        def pick(values: tuple[float, ...]) -> tuple[float, ...]:
            return tuple(values[column] for column in columns)

        points = tuple(JointMotion(pick(p.q), pick(p.qdot), pick(p.qddot)) for p in self.points)
        return SetpointPacket(names, self.times, points)


@dataclass(frozen=True, slots=True)
class Measurement:
    """What the joints were measured to do, at ``time`` [s]; shape (n,), in robot.yaml's order."""

    q: tuple[float, ...]
    qdot: tuple[float, ...]
    time: float

    def extrapolated(self, now: float) -> tuple[float, ...]:
        """Return the positions at ``now``, by the measured velocities."""
        return tuple(q + v * (now - self.time) for q, v in zip(self.q, self.qdot))
