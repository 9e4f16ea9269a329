"""Requests for a joint move: checked, completed, their end; and what is reported meanwhile."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scara_config import Joint

from scara_control.config import MoveConfig, in_si
from scara_control.joint_motion import JointMotion, Vector
from scara_control.limits import check_joint_vector, check_limits
from scara_control.motion.commands import MotionRefusedError


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
    peak_percent: float
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
    joints: Sequence[Joint],
    names: Sequence[str],
    positions: Sequence[float],
    speed_percent: float,
    config: MoveConfig,
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
    return MoveRequest(
        {joint.name: q for joint, q in zip(named, values)}, check_speed(speed_percent, config)
    )


def check_speed(speed_percent: float, config: MoveConfig) -> float:
    """Return a program speed in percent; 0 is the default.

    Raises:
        MotionRefusedError: Not 0 and outside 1 to 100.
    """
    if speed_percent == 0.0:
        return config.default_speed_percent
    if not (math.isfinite(speed_percent) and 1.0 <= speed_percent <= 100.0):
        raise MotionRefusedError(
            f"speed_percent = {speed_percent:g} is outside [1, 100] (0: the default)"
        )
    return float(speed_percent)


class MoveLedger:
    """Counts moves and streams, and waits for the joints at the end of a move.

    It says how each move has ended.
    """

    def __init__(self, joints: Sequence[Joint], config: MoveConfig) -> None:
        """Start without any move."""
        self._joints = tuple(joints)
        self._config = config
        self._started = self._deadline = 0.0
        self._target: Vector | None = None
        self._outcomes: list[Outcome] = []
        self.move_id = 0
        self.running = False

    @property
    def settling(self) -> bool:
        """Whether the plan has ended and the joints are waited for."""
        return self._target is not None

    def begin(self, now: float, is_move: bool) -> None:
        """Count a move (which will have an outcome) or a stream (which has none)."""
        self.move_id += 1
        self.running, self._started, self._target = is_move, now, None

    def settle(self, target: Vector, now: float) -> None:
        """Note that the plan has ended; from now on the joints are waited for."""
        if self.running:
            self._target, self._deadline = target, now + self._config.settle_timeout

    def arrive(self, measured: JointMotion, now: float) -> str:
        """End the move once the joints are at the target, or when they are not in time.

        Say why not.
        """
        if self._target is None:
            return ""
        away = [
            f"{joint.name} is {abs(wanted - q) / joint.scale:.3f} {joint.unit} from its target"
            for joint, wanted, q in zip(self._joints, self._target, measured.q)
            if abs(wanted - q)
            > in_si(joint, self._config.position_tolerance_deg, self._config.position_tolerance_mm)
        ]
        if not away:
            self.end(True, f"reached in {now - self._started:.2f} s", measured, now)
        elif now >= self._deadline:
            text = (
                f"not reached {self._config.settle_timeout:g} s after the end of the "
                f"plan: {'; '.join(away)}"
            )
            self.end(False, text, measured, now)
            return text
        return ""

    def end(self, success: bool, message: str, measured: JointMotion | None, now: float) -> None:
        """End the running move, if there is one."""
        if self.running:
            positions = measured.q if measured is not None else ()
            self._outcomes.append(
                Outcome(self.move_id, success, message, positions, now - self._started)
            )
        self.running, self._target = False, None

    def take_outcomes(self) -> list[Outcome]:
        """Return how moves have ended since the last call."""
        outcomes, self._outcomes = self._outcomes, []
        return outcomes
