"""Joint motion, in one type for an instant and one for what a wire brings.

The third type, :class:`~scara_control.joint_track.JointTrack`, gives the motion between the points.
Converters stand only at wires: ``motion/setpoint_messages_node.py`` has those of ROS.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import msgspec

Vector = tuple[float, ...]

AxisMotion = tuple[float, float, float]
"""Position, velocity and acceleration of one joint: a plain tuple, for loops at 1 kHz."""


class JointMotion(msgspec.Struct, frozen=True, array_like=True):
    """What joints do at one instant; each vector of shape (n,), SI.

    Attributes:
        q: Joint positions [rad], prismatic [m].
        qdot: Velocities; empty only in a goal that leaves them to the planner, and in a reading of
            a robot that tells none.
        qddot: Accelerations; likewise.
        time: The instant [s], on the axis of whoever holds the motion. It stays 0 where something
            else tells the instant: a path or a drive.
    """

    q: Vector
    qdot: Vector
    qddot: Vector
    time: float = 0.0

    @classmethod
    def at_rest(cls, q: Sequence[float]) -> JointMotion:
        """Return standing still at ``q``."""
        zeros = (0.0,) * len(q)
        return cls(tuple(q), zeros, zeros)

    @classmethod
    def measured(cls, q: Sequence[float], qdot: Sequence[float], time: float) -> JointMotion:
        """Return what was measured at ``time`` [s]; accelerations are not measured, so zero."""
        return cls(tuple(q), tuple(qdot), (0.0,) * len(q), time)

    def filled(self) -> JointMotion:
        """Return the motion with zeros for velocities and accelerations that were left out."""
        if self.qdot and self.qddot:
            return self
        zeros = (0.0,) * len(self.q)
        return JointMotion(self.q, self.qdot or zeros, self.qddot or zeros, self.time)

    def after(self, dt: float) -> JointMotion:
        """Extrapolate by ``dt`` [s] with constant acceleration."""
        return JointMotion(
            tuple(q + dt * (v + 0.5 * dt * a) for q, v, a in zip(self.q, self.qdot, self.qddot)),
            tuple(v + dt * a for v, a in zip(self.qdot, self.qddot)),
            self.qddot,
        )

    def extrapolated(self, now: float) -> Vector:
        """Return the positions at ``now`` [s], by the velocities alone."""
        return tuple(q + v * (now - self.time) for q, v in zip(self.q, self.qdot))

    def select(self, columns: Sequence[int]) -> JointMotion:
        """Return the motion of only some joints; what was left out stays so."""
        q, qdot, qddot = (
            tuple([values[column] for column in columns]) if values else ()
            for values in (self.q, self.qdot, self.qddot)
        )
        return JointMotion(q, qdot, qddot, self.time)


class Setpoints(msgspec.Struct, frozen=True, array_like=True):
    """Set points of the joints ``names`` as a wire carries them; not checked by itself.

    Each point is due at its time, strictly increasing once it is checked.
    """

    names: tuple[str, ...]
    points: tuple[JointMotion, ...]

    @classmethod
    def due(
        cls, names: tuple[str, ...], times: Iterable[float], motions: Iterable[JointMotion]
    ) -> Setpoints:
        """Return motions as set points that are due at ``times`` [s], one for each."""
        pairs = zip(times, motions, strict=True)
        return cls(names, tuple([JointMotion(m.q, m.qdot, m.qddot, at) for at, m in pairs]))

    @property
    def times(self) -> tuple[float, ...]:
        """When each point is due [s]."""
        return tuple([point.time for point in self.points])

    def select(self, names: tuple[str, ...]) -> Setpoints:
        """Return the same points of only some joints."""
        columns = [self.names.index(name) for name in names]
        return Setpoints(names, tuple(point.select(columns) for point in self.points))

    def completed(self, names: tuple[str, ...], held: Mapping[str, float]) -> Setpoints:
        """Return the points of all ``names``, in their order.

        What was left out is filled in: joints by the positions that they hold, at rest, velocities
        and accelerations by zeros. Joints that are not among ``names`` are left away.

        Args:
            names: The joints wanted.
            held: Position of each joint that these points lack [rad], prismatic [m].

        Raises:
            KeyError: A joint is neither here nor in ``held``.
        """
        here = {name: column for column, name in enumerate(self.names)}
        rest = {name: held[name] for name in names if name not in here}

        def fill(point: JointMotion) -> JointMotion:
            whole = point.filled()
            rows = (whole.q, whole.qdot, whole.qddot)
            instead: tuple[Mapping[str, float], ...] = (rest, {}, {})
            q, qdot, qddot = (
                tuple(row[here[n]] if n in here else other.get(n, 0.0) for n in names)
                for row, other in zip(rows, instead)
            )
            return JointMotion(q, qdot, qddot, point.time)

        return Setpoints(names, tuple(map(fill, self.points)))
