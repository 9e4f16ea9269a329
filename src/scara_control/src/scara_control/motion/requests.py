"""Requests for a joint move: checked, completed, their end; and what is reported meanwhile."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scara_config import Joint, Robot
from scara_ros.message_struct import struct_of

from scara_control.config import MotionConfig, MoveConfig, in_si
from scara_control.joint_motion import JointMotion, Vector
from scara_control.kinematics.tool import tool_kinematics
from scara_control.kinematics.tool_path import MoveWay
from scara_control.limits import check_joint_vector, check_limits
from scara_control.motion.commands import MotionRefusedError
from scara_control.motion.trim import Trimming
from scara_msgs.msg import MotionState


@dataclass(frozen=True, slots=True)
class MoveRequest:
    """A checked request: wanted positions by joint, the others hold; program speed in percent.

    ``way``: how it goes there; None: straight to the joints' targets.
    """

    positions: dict[str, float]
    speed_percent: float
    way: MoveWay | None = None

    def target(self, joints: Sequence[Joint], hold: Sequence[float]) -> Vector:
        """Return the target of all joints; ``hold`` is where the others stay."""
        return tuple(self.positions.get(joint.name, q) for joint, q in zip(joints, hold))


class PoseReport(struct_of(MotionState)):  # type: ignore[misc]
    """What the controller does: the fields of scara_msgs/MotionState."""

    way: tuple[Vector, ...] = ()


@dataclass(frozen=True, slots=True)
class Jog:
    """Velocities for joint_vel_controller [rad/s] or [m/s]."""

    names: tuple[str, ...]
    velocities: Vector


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
    way: MoveWay | None = None,
) -> MoveRequest:
    """Check a request for a joint move.

    Args:
        joints: The joints there are, in order.
        names: Joints to move; empty: all.
        positions: One for each name, [rad] or [m].
        speed_percent: 1 to 100; 0: the default.
        config: The default speed.
        way: How it goes there; None: straight to the joints' targets.

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
    by_name = {joint.name: q for joint, q in zip(named, values)}
    return MoveRequest(by_name, check_speed(speed_percent, config), way)


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
    """Counts moves and streams, waits for the joints at the end of a move, and has it trimmed.

    It says how each move has ended.
    """

    def __init__(self, robot: Robot, config: MotionConfig) -> None:
        """Start without any move."""
        self._joints = tuple(robot.twin_joints)
        self._tool = tool_kinematics(robot)
        self._trimmed, self._config = config, config.move
        self._started = self._deadline = 0.0
        self._target: Vector | None = None
        self._trim: Trimming | None = None
        # What the joints of a trim are to be told; taken once.
        self._jog: Jog | None = None
        self._outcomes: list[Outcome] = []
        self.move_id = 0
        self.running = False

    @property
    def settling(self) -> bool:
        """Whether the plan has ended and the joints are waited for."""
        return self._target is not None

    @property
    def trimming(self) -> bool:
        """Whether the joints have arrived and the tool is trimmed."""
        return self._trim is not None and self._trim.begun

    def begin(self, now: float, is_move: bool, trims_at: Sequence[float] = ()) -> None:
        """Count a move (which will have an outcome) or a stream (which has none).

        A move that ``trims_at`` its target, all joints, ends once the tool stays there.
        """
        self.move_id += 1
        self.running, self._started, self._target = is_move, now, None
        self._trim = self._jog = None
        if trims_at:
            there = [q for joint, q in zip(self._joints, trims_at) if joint in self._tool.joints]
            self._trim = Trimming(self._tool, there, self._trimmed)

    def settle(self, target: Vector, now: float) -> None:
        """Note that the plan has ended; from now on the joints are waited for."""
        if self.running:
            self._target, self._deadline = target, now + self._config.settle_timeout

    def arrive(self, measured: JointMotion, now: float, held: bool = False) -> str:
        """End the move once the joints are at the target and trimmed, or are not in time.

        Say why not. A trim that is ``held`` waits.
        """
        if self._target is None:
            return ""
        if self._trim is not None and self._trim.begun:
            return self._go_on(self._trim, measured, now, held)
        away = [
            f"{joint.name} is {abs(wanted - q) / joint.scale:.3f} {joint.unit} from its target"
            for joint, wanted, q in zip(self._joints, self._target, measured.q)
            if abs(wanted - q)
            > in_si(joint, self._config.position_tolerance_deg, self._config.position_tolerance_mm)
        ]
        if not away and self._trim is not None:
            self._trim.begin(now)
        elif not away:
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
        self.running, self._target, self._trim, self._jog = False, None, None, None

    def take_jog(self) -> Jog | None:
        """Return what the joints of a trim are to be told, if that is new."""
        jog, self._jog = self._jog, None
        return jog

    def _go_on(self, trim: Trimming, measured: JointMotion, now: float, held: bool) -> str:
        """Go on with the trim; say why it fails."""
        if held:
            trim.hold(now)
            return ""
        columns = [k for k, joint in enumerate(self._joints) if joint.name in trim.names]
        q, qdot = ([row[k] for k in columns] for row in (measured.q, measured.qdot))
        try:
            velocities = trim.step(q, qdot, now)
        except MotionRefusedError as error:
            self.end(False, str(error), measured, now)
            # It jogs no longer.
            self._jog = Jog(trim.names, (0.0,) * len(trim.names))
            return str(error)
        if trim.settled:
            self.end(True, f"reached in {now - self._started:.2f} s", measured, now)
        elif velocities is not None:
            self._jog = Jog(trim.names, velocities)
        return ""

    def take_outcomes(self) -> list[Outcome]:
        """Return how moves have ended since the last call."""
        outcomes, self._outcomes = self._outcomes, []
        return outcomes
