"""Requests for a joint move: checked, completed, their end; and what is reported meanwhile."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scara_config import Joint

from scara_control.config import MoveConfig, in_si
from scara_control.limits import check_joint_vector, check_limits
from scara_control.motion.commands import MotionRefusedError
from scara_control.motion.packets import Measurement
from scara_control.motion.plan import Vector


@dataclass(frozen=True, slots=True)
class MoveRequest:
    """A checked request: wanted positions by joint, the others hold; program speed in percent."""

    positions: dict[str, float]
    speed_percent: float

    def target(self, joints: Sequence[Joint], hold: Sequence[float]) -> Vector:
        """Return the target of all joints; ``hold`` is where the others stay."""
        return tuple(self.positions.get(joint.name, q) for joint, q in zip(joints, hold))


@dataclass(frozen=True, slots=True)
class PoseReport:
    """What the controller does; the fields of scara_msgs/MotionState."""

    state: str
    move_id: int
    setpoint: Vector
    target: Vector
    speed_requested_percent: float
    speed_applied_percent: float
    speed_limit_percent: float
    standing_still: bool
    message: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a move has ended."""

    move_id: int
    success: bool
    message: str
    positions: Vector
    duration: float


def check_move(
    joints: Sequence[Joint], names: Sequence[str], positions: Sequence[float], speed_percent: float, config: MoveConfig
) -> MoveRequest:
    """Check a request for a joint move.

    Args:
        joints: The joints there are, in order.
        names: Joints to move; empty: all.
        positions: One for each name, [rad] or [m].
        speed_percent: 1 to 100; 0: the default.
        config: The default speed.

    Raises:
        MotionRefusedError: Unknown or doubled joint, or a speed outside its range.
        JointVectorError: A wrong count, or not finite.
        JointLimitError: A position is outside its limits.
    """
    known = {joint.name: joint for joint in joints}
    for name in names:
        if name not in known:
            raise MotionRefusedError(f"unknown joint {name!r}: the twin has {', '.join(known)}")
    if len(set(names)) != len(names):
        raise MotionRefusedError(f"a joint occurs twice: {', '.join(names)}")
    named = [known[name] for name in names] if names else list(joints)
    values = check_limits(named, check_joint_vector(named, positions))
    return MoveRequest({joint.name: q for joint, q in zip(named, values)}, check_speed(speed_percent, config))


def check_speed(speed_percent: float, config: MoveConfig) -> float:
    """Return a program speed in percent; 0 is the default.

    Raises:
        MotionRefusedError: Not 0 and outside 1 to 100.
    """
    if speed_percent == 0.0:
        return config.default_speed_percent
    if not (math.isfinite(speed_percent) and 1.0 <= speed_percent <= 100.0):
        raise MotionRefusedError(f"speed_percent = {speed_percent:g} is outside [1, 100] (0: the default)")
    return float(speed_percent)


@dataclass(frozen=True, slots=True)
class Settling:
    """A move whose plan has ended and whose joints are waited for."""

    move_id: int
    target: Vector
    started: float
    deadline: float

    def check(self, joints: Sequence[Joint], measured: Measurement, config: MoveConfig, now: float) -> Outcome | None:
        """Return how the move has ended, or None while the joints may still arrive."""
        away = [
            f"{joint.name} is {abs(wanted - q) / joint.scale:.3f} {joint.unit} from its target"
            for joint, wanted, q in zip(joints, self.target, measured.q)
            if abs(wanted - q) > in_si(joint, config.position_tolerance_deg, config.position_tolerance_mm)
        ]
        duration = now - self.started
        if not away:
            return Outcome(self.move_id, True, f"reached in {duration:.2f} s", measured.q, duration)
        if now < self.deadline:
            return None
        text = f"not reached {config.settle_timeout:g} s after the end of the plan: {'; '.join(away)}"
        return Outcome(self.move_id, False, text, measured.q, duration)
