r"""All joints' loops together.

Set points go in and efforts come out, with the inverse dynamics as feed-forward.

The feed-forward is computed torque: the acceleration it is asked for holds the error of the wanted
position,

.. math:: a = \ddot q_r + \omega^2 (q_r - q) + 2 \omega (\dot q_r - \dot q),

so that the mass matrix spreads the correction over the joints. A correction of one joint then does
not push the others, and a set point that was extrapolated wrongly is recovered from at the
bandwidth :math:`\omega`, whatever the pose. The PID loops stay as they are and take what the model
does not know.

Source: Lynch & Park, Modern Robotics (2017), sec. 11.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from scara_control.joint_track import JointTrack

from scara_simulation.catch_up import JUMP
from scara_simulation.config import LoopGains
from scara_simulation.joints.cells import step_efforts
from scara_simulation.joints.loop import JointLoop
from scara_simulation.joints.model import JointModel

InverseDynamics = Callable[[list[float], list[float], list[float]], Sequence[float]]
"""Efforts of all joints for positions, velocities and accelerations, without damping and
friction."""


class JointControl:
    """The loops of the twin's joints, in robot.yaml's order."""

    def __init__(
        self,
        models: Sequence[JointModel],
        gains: Sequence[LoopGains],
        start: Sequence[float],
        dt: float,
        inverse_dynamics: InverseDynamics | None,
        bandwidth: float = 0.0,
        *,
        compiled: bool = True,
    ) -> None:
        """Hold the start pose.

        Args:
            models: One for each joint.
            gains: One for each joint.
            start: Positions to hold, shape (n,): [rad], prismatic [m].
            dt: Length of a step [s].
            inverse_dynamics: None: plain PID, no feed-forward, not even of gravity and friction.
            bandwidth: Of the error in the computed torque [rad/s]; 0: pure feed-forward.
            compiled: Whether C does the steps, where it was built; the same bits either way.
        """
        model_based = inverse_dynamics is not None
        self.loops = [
            JointLoop(model, gain, q, model_based=model_based)
            for model, gain, q in zip(models, gains, start, strict=True)
        ]
        self._index = {model.name: k for k, model in enumerate(models)}
        self._start = tuple(start)
        self._dt = dt
        self._inverse_dynamics = inverse_dynamics
        # Two poles at the bandwidth: an error goes away without swinging over.
        self._stiffness, self._damping = bandwidth * bandwidth, 2.0 * bandwidth
        self._compiled = compiled and step_efforts is not None
        self._no_feed_forward = [0.0] * len(self.loops)

    @property
    def modes(self) -> str:
        """The mode of each joint: ``joint_1:trajectory joint_2:position ...``."""
        return " ".join(f"{loop.model.name}:{loop.mode}" for loop in self.loops)

    @property
    def saturated_steps(self) -> int:
        """How often a joint's effort was limited."""
        return sum(loop.saturated_steps for loop in self.loops)

    @property
    def saturated_steps_of(self) -> dict[str, int]:
        """How often the effort of each joint was limited."""
        return {loop.model.name: loop.saturated_steps for loop in self.loops}

    @property
    def limited_steps(self) -> int:
        """How often a joint's set point was kept inside its limits."""
        return sum(loop.limited_steps for loop in self.loops)

    def command_position(self, name: str, position: float) -> None:
        """Let one joint go to ``position`` [rad] or [m]."""
        self.loops[self._index[name]].command_position(position)

    def command_velocity(self, name: str, velocity: float, until: float = math.inf) -> None:
        """Let one joint move with ``velocity`` [rad/s] or [m/s] until the time ``until`` [s]."""
        self.loops[self._index[name]].command_velocity(velocity, until)

    def limit_speed(self, percent: float) -> None:
        """Cap the speed of direct commands [percent of each joint's velocity]."""
        for loop in self.loops:
            loop.limit_speed(percent)

    def stop(self) -> None:
        """Let each joint that a direct command moves come to rest and hold there."""
        for loop in self.loops:
            loop.stop()

    def end_tracks(self, t: float) -> None:
        """Let each joint come to rest that set points move at the time ``t`` [s], or will later."""
        for loop in self.loops:
            loop.end_track(t)

    def command_track(self, names: Sequence[str], track: JointTrack) -> None:
        """Let the joints called ``names`` follow the columns of ``track``."""
        for column, name in enumerate(names):
            self.loops[self._index[name]].command_track(track, column)

    def set_gains(self, name: str, gains: LoopGains) -> None:
        """Let one joint's loops go on with other gains."""
        self.loops[self._index[name]].set_gains(gains)

    def permit(self, shares: Sequence[float]) -> None:
        """Let each joint have a share of its acceleration, (0, 1], in direct commands."""
        for loop, share in zip(self.loops, shares, strict=True):
            loop.permit(share)

    def moving(self, qdot: Sequence[float]) -> list[str]:
        """Return the joints that do not rest, by what was measured and by what is wanted."""
        return [
            loop.model.name for loop, v in zip(self.loops, qdot, strict=True) if loop.is_moving(v)
        ]

    def postpone(self, duration: float) -> None:
        """Let all set points be due ``duration`` [s] later: time stood still that long."""
        for loop in self.loops:
            loop.postpone(duration)

    def start(self, start: Sequence[float]) -> None:
        """Hold another pose from the next :meth:`reset` on, shape (n,): [rad], prismatic [m]."""
        self._start = tuple(start)

    def reset(self) -> None:
        """Forget every command and hold the start pose."""
        for loop, q in zip(self.loops, self._start):
            loop.reset(q)

    def efforts(self, t: float, q: Sequence[float], qdot: Sequence[float]) -> list[float]:
        """Compute the efforts of the step that begins at ``t``.

        Args:
            t: Nominal time of the step [s], on the axis of the set points.
            q: Measured positions, shape (n,): [rad], prismatic [m].
            qdot: Measured velocities, shape (n,).

        Returns:
            Efforts, shape (n,): [N m], prismatic [N].
        """
        if self._compiled:
            found: list[float] = step_efforts(
                self.loops,
                t,
                q,
                qdot,
                self._dt,
                self._inverse_dynamics,
                self._stiffness,
                self._damping,
                JUMP,
            )
            return found
        dt, loops = self._dt, self.loops
        wanted = [loop.reference(t, q[k], qdot[k], dt) for k, loop in enumerate(loops)]
        feed_forward: Sequence[float] = self._no_feed_forward
        if self._inverse_dynamics is not None:
            stiffness, damping = self._stiffness, self._damping
            # As in the loops, a measured velocity belongs to the middle of the last step.
            accelerations = [
                a + stiffness * (p - q[k]) + damping * (v - 0.5 * dt * a - qdot[k])
                for k, (p, v, a) in enumerate(wanted)
            ]
            feed_forward = self._inverse_dynamics(
                [w[0] for w in wanted], [w[1] for w in wanted], accelerations
            )
        return [loop.effort(q[k], qdot[k], feed_forward[k], dt) for k, loop in enumerate(loops)]
