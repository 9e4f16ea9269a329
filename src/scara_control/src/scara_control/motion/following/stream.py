"""Streamed set points: a session of them, and when the stream is listened to."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scara_config import Joint

from scara_control.config import FollowConfig, in_si
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.joint_track import JointTrack
from scara_control.motion.commands import MotionRefusedError
from scara_control.motion.feedback import Feedback
from scara_control.motion.following.checks import check_setpoints, check_step


class FollowSession:
    """One stream, from its first good packet to its end."""

    def __init__(
        self,
        joints: Sequence[Joint],
        setpoints: Setpoints,
        config: FollowConfig,
        measured: JointMotion,
        now: float,
    ) -> None:
        """Begin with the first set points.

        Args:
            joints: All joints, in robot.yaml's order.
            setpoints: The first ones.
            config: Tolerances.
            measured: All joints.
            now: [s]

        Raises:
            MotionRefusedError: The packet is wrong, or not where the joints are.
        """
        self._joints = tuple(joints)
        self._config = config
        self._named = check_setpoints(joints, setpoints, config, now)
        self._columns = [[joint.name for joint in joints].index(name) for name in setpoints.names]
        self._rest = measured.q
        # Kept before the check, which asks where they lead at this moment.
        self._accept(setpoints, now)
        self._check_start(measured, now)

    @property
    def names(self) -> tuple[str, ...]:
        """The joints of this stream."""
        return self._latest.names

    def take(self, setpoints: Setpoints, now: float) -> None:
        """Take the next packet in.

        Raises:
            MotionRefusedError: It is wrong in itself, of other joints, not newer, or a jump.
        """
        named = check_setpoints(self._joints, setpoints, self._config, now)
        if setpoints.names != self.names:
            raise MotionRefusedError(
                f"other joints than before: {', '.join(setpoints.names)} after "
                f"{', '.join(self.names)}"
            )
        dt = setpoints.points[0].time - self._latest.points[0].time
        if dt <= 0.0:
            raise MotionRefusedError(f"stamp is not newer than the one before ({dt * 1e3:.1f} ms)")
        check_step(
            named,
            self._latest.points[0].q,
            setpoints.points[0].q,
            dt,
            self._config,
            "since the last packet",
        )
        self._accept(setpoints, now)

    def timed_out(self, now: float) -> bool:
        """Say whether the last good packet came longer than the time-out ago."""
        return now - self._arrived > self._config.timeout

    def motion(self, now: float) -> JointMotion:
        """Return what all joints do at ``now`` by the last packet.

        Joints that are not streamed rest.
        """
        # A track stands still before its first point; a stream that is early moves already.
        early = now - self._latest.points[0].time
        if early < 0.0:
            streamed = self._latest.points[0].after(max(early, -self._config.extrapolation))
        else:
            streamed = self._track.at(now)
        rest = JointMotion.at_rest(self._rest)
        return JointMotion(
            self._put(rest.q, streamed.q),
            self._put(rest.qdot, streamed.qdot),
            self._put(rest.qddot, streamed.qddot),
        )

    def _put(self, values: Sequence[float], streamed: Sequence[float]) -> tuple[float, ...]:
        """Return ``values`` with the streamed joints' ones in their columns."""
        merged = list(values)
        for column, value in zip(self._columns, streamed):
            merged[column] = value
        return tuple(merged)

    def _accept(self, setpoints: Setpoints, now: float) -> None:
        """Keep set points that :func:`check_setpoints` has let through."""
        self._track = JointTrack.from_checked(
            setpoints,
            extrapolation_limit=self._config.extrapolation,
            stop_accelerations=[joint.acceleration for joint in self._named],
        )
        self._latest, self._arrived = setpoints, now

    def _check_start(self, measured: JointMotion, now: float) -> None:
        """Refuse to begin far from where the joints are."""
        wanted, there = self.motion(now).q, measured.extrapolated(now)
        for column in self._columns:
            joint = self._joints[column]
            off = wanted[column] - there[column]
            allowed = in_si(
                joint, self._config.start_tolerance_deg, self._config.start_tolerance_mm
            )
            if abs(off) > allowed:
                raise MotionRefusedError(
                    f"align first: {joint.name} is {abs(off) / joint.scale:.2f} {joint.unit} "
                    "from the first set point, "
                    f"allowed {allowed / joint.scale:g}"
                )


class StreamGate:
    """Whether the stream is listened to.

    After a STOP this is not before it has paused, so that a late packet moves nothing.
    """

    def __init__(self, what: str, timeout: float) -> None:
        """Start open; ``what`` comes streamed, ``timeout`` [s] is the pause that counts."""
        self._what = what
        self._timeout = timeout
        self._heard = -math.inf
        self.barred = False

    def bar(self, now: float) -> None:
        """Listen no more to the stream that is running now."""
        # What has paused already is no longer the stream that the stop was for.
        self.barred = now - self._heard <= self._timeout

    def cancel(self, now: float) -> None:
        """Note that a packet from before a stop came: what it belongs to is not listened to."""
        self._heard, self.barred = now, True

    def forgive(self, gap: float) -> None:
        """Leave out a gap [s] in which nobody listened: it is no pause of who streams."""
        self._heard += gap

    def check(self, now: float) -> None:
        """Note that a packet came.

        Raises:
            MotionRefusedError: The stream was stopped and has not paused since.
        """
        # A packet that is refused counts as heard: only silence opens the gate.
        pause, self._heard = now - self._heard, now
        self.barred = self.barred and pause <= self._timeout
        if self.barred:
            raise MotionRefusedError(
                f"stopped: {self._what} are ignored until they pause for "
                f"{self._timeout * 1e3:.0f} ms"
            )


class SetpointStream:
    """The streamed set points of joint_pose_controller.

    They are at most one session, its gate, and what was refused.
    """

    def __init__(self, joints: Sequence[Joint], config: FollowConfig) -> None:
        """Start without a session."""
        self._joints = tuple(joints)
        self._config = config
        self._gate = StreamGate("packets", config.timeout)
        self.session: FollowSession | None = None
        self.refused = 0

    def take(self, setpoints: Setpoints, feedback: Feedback, other: str, now: float) -> bool:
        """Take a packet in; return whether it begins a session.

        Args:
            setpoints: Not checked yet.
            feedback: Where the joints are.
            other: What else has command of the joints, in words; empty: nothing.
            now: [s]

        Raises:
            MotionRefusedError: It is refused; this is counted.
        """
        try:
            self._gate.check(now)
            if other:
                raise MotionRefusedError(other)
            if self.session is not None:
                self.session.take(setpoints, now)
                return False
            self.session = FollowSession(
                self._joints, setpoints, self._config, feedback.fresh(now), now
            )
        except MotionRefusedError:
            self.refused += 1
            raise
        return True

    @property
    def barred(self) -> bool:
        """Whether it was stopped and has not paused since."""
        return self._gate.barred

    def forgive(self, gap: float) -> None:
        """Leave out a gap [s] in which nobody listened; see :class:`StreamGate`."""
        self._gate.forgive(gap)

    def bar(self, now: float) -> None:
        """Listen no more to the stream that is running now."""
        self._gate.bar(now)

    def silence(self, now: float) -> str:
        """Say that the stream has broken off, or return an empty text."""
        if self.session is None or not self.session.timed_out(now):
            return ""
        return f"follow: no packet for {self._config.timeout * 1e3:.0f} ms"
