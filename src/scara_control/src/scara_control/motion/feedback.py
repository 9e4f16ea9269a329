"""What is known of the joints: measured, how old, and where a new motion may begin."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scara_config import Joint

from scara_control.config import MotionConfig, in_si
from scara_control.joint_motion import JointMotion, Vector
from scara_control.motion.commands import MotionRefusedError, Ownership


def standstill_speeds(joints: Sequence[Joint], config: MotionConfig) -> Vector:
    """Return below which speed each joint counts as standing [rad/s] or [m/s]."""
    move = config.move
    return tuple(in_si(joint, move.standstill_deg_s, move.standstill_mm_s) for joint in joints)


class Feedback:
    """The last measurement of all joints."""

    def __init__(self, joints: Sequence[Joint], config: MotionConfig) -> None:
        """Start without any measurement."""
        self._joints = tuple(joints)
        self._config = config
        self.measured: JointMotion | None = None
        self._stopped = -math.inf
        self.standstill = standstill_speeds(joints, config)

    def fresh(self, now: float) -> JointMotion:
        """Return the last measurement.

        Raises:
            MotionRefusedError: There is none, or it is older than allowed.
        """
        if self.measured is None:
            raise MotionRefusedError("no twin/joint_states yet")
        age = now - self.measured.time
        if age > self._config.state_timeout:
            raise MotionRefusedError(
                f"twin/joint_states is {age:.2f} s old, allowed {self._config.state_timeout:g}"
            )
        return self.measured

    def trouble(self, now: float) -> str:
        """Say why :meth:`fresh` would refuse, or return an empty text."""
        try:
            self.fresh(now)
        except MotionRefusedError as error:
            return str(error)
        return ""

    def stop(self, now: float) -> bool:
        """Note that all joints were told to stop; return :meth:`coasts`."""
        self._stopped = now
        return self.coasts(now)

    def coasts(self, now: float) -> bool:
        """Return whether a joint that was told to stop is measured to move, whoever moves it.

        Joints that never come to rest do so for ``move.settle_timeout`` at most.
        """
        late = now - self._stopped > self._config.move.settle_timeout
        if late or self.measured is None or self.trouble(now):
            return False
        return any(abs(v) > slow for v, slow in zip(self.measured.qdot, self.standstill))

    def rest(
        self, setpoint: Vector | None, ownership: Ownership, now: float, trims: bool = False
    ) -> Vector:
        """Return where the joints rest.

        That is at our last set point if they obey us and are there, else where measured. Joints
        that a trim of ours moves are where they are now: so slow, they rest at once.

        Raises:
            MotionRefusedError: No fresh measurement, or a joint is moved by somebody else.
        """
        measured, config, rest = self.fresh(now), self._config.move, []
        if trims:
            return measured.extrapolated(now)
        for k, joint in enumerate(self._joints):
            q, qdot, foreign = measured.q[k], measured.qdot[k], ownership.foreign(joint.name)
            near = in_si(joint, config.start_tolerance_deg, config.start_tolerance_mm)
            # From the reading, the set point would jump by what the loops have left.
            if setpoint is not None and not foreign and abs(setpoint[k] - q) <= near:
                rest.append(setpoint[k])
                continue
            if abs(qdot) > self.standstill[k]:
                by = f" under its {foreign} controller" if foreign else ""
                raise MotionRefusedError(
                    f"{joint.name} moves at {qdot / joint.scale:.2f} {joint.unit}/s{by}: "
                    "stop it first"
                )
            rest.append(q)
        return tuple(rest)
