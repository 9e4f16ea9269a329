"""The twin's ROS messages as rosbridge carries them, converted to inputs and from actions; pure and checked.

Everything that arrives is checked here: names, counts, finite numbers. What does not fit raises PacketError, is counted
by the shell and never reaches the core.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard, TypeVar

from scara_control.errors import ScaraControlError
from scara_control.setpoints import SetpointTrack

from twin_controller.core.actions import Do, FollowTwin, Perform
from twin_controller.core.events import ClockProbe, Joints, TwinGripper, TwinMeasured, TwinMotion, TwinPlan

JOINT_STATES = "twin/joint_states"
JOINT_SETPOINTS = "twin/joint_setpoints"
MOTION_STATE = "joint_pose_controller/state"
GRIPPER = "twin/gripper"
FOLLOW = "joint_pose_controller/follow"
SPEED_LIMIT = "joint_pose_controller/speed_limit_percent"
MOTION_COMMAND = "motion_command"
SENDER = "twin_controller"
MOTION_STATES = ("idle", "announcing", "moving", "following", "pausing", "paused", "stopping", "estopped")
SECONDS = 1 << 32
"""ROS times are uint32 seconds; what lies beyond cannot be one."""

T = TypeVar("T")
_COMMANDS = {Do.STOP_TWIN: 1, Do.PAUSE_TWIN: 2, Do.RESUME_TWIN: 3, Do.ESTOP_TWIN: 4, Do.RESET_TWIN: 5}


class PacketError(ValueError):
    """A packet of the twin does not fit; the text names the field and what was expected."""


def twin_measured(message: Mapping[str, Any], names: Sequence[str], now: float) -> TwinMeasured:
    """Convert a sensor_msgs/JointState.

    Args:
        message: The message as parsed JSON.
        names: The twin's joints in the core's order.
        now: When it arrived [s].

    Raises:
        PacketError: A joint is missing, a count is wrong, a value is not finite.
    """
    order = _order(message, "name", names)
    return TwinMeasured(now, _stamp(message), _row(message, "position", order), _row(message, "velocity", order))


def twin_plan(message: Mapping[str, Any], names: Sequence[str], now: float) -> TwinPlan:
    """Convert a trajectory_msgs/JointTrajectory of coming set points.

    Raises:
        PacketError: A joint is missing, a count is wrong, a value is not finite, times do not increase.
    """
    order = _order(message, "joint_names", names)
    points = message.get("points")
    if not isinstance(points, list) or not points:
        raise PacketError("points: empty")
    times = tuple(_time(point, "time_from_start") for point in points)
    q = tuple(_row(point, "positions", order) for point in points)
    qdot = tuple(_row(point, "velocities", order) for point in points)
    qddot = tuple(_row(point, "accelerations", order) for point in points)
    try:
        SetpointTrack(times, q, qdot, qddot, extrapolation_limit=0.0, stop_accelerations=[1.0] * len(names))
    except ScaraControlError as error:
        raise PacketError(f"points: {error}") from error
    return TwinPlan(now, _stamp(message), times, q, qdot, qddot)


def twin_motion(message: Mapping[str, Any], names: Sequence[str], now: float) -> TwinMotion:
    """Convert a scara_msgs/MotionState.

    Raises:
        PacketError: A field is missing, of the wrong type, or the state is unknown.
    """
    state = _typed(message, "state", str)
    if state not in MOTION_STATES:
        raise PacketError(f"state = {state[:40]!r}: expected one of {', '.join(MOTION_STATES)}")
    number = _typed(message, "last_command_id", int)
    if not 0 <= number < 1 << 32:
        raise PacketError(f"last_command_id = {_shown(number)}: expected a uint32")
    return TwinMotion(
        now,
        state,
        _number(message, "speed_requested_percent"),
        _number(message, "speed_applied_percent"),
        _number(message, "speed_limit_percent"),
        number,
        _typed(message, "standing_still", bool),
        _typed(message, "message", str),
        _row(message, "target", _order(message, "name", names)) if message.get("target") else (),
    )


def twin_gripper(message: Mapping[str, Any], now: float) -> TwinGripper:
    """Convert a scara_msgs/GripperState.

    Raises:
        PacketError: A field is missing or of the wrong type.
    """
    return TwinGripper(now, _typed(message, "commanded", bool), _typed(message, "holding", bool), _typed(message, "part", str))


def clock_probe(values: Mapping[str, Any], sent: float, received: float) -> ClockProbe:
    """Convert the answer of /rosapi/get_time.

    Raises:
        PacketError: There is no time in it.
    """
    return ClockProbe(received, sent, received, _time(values, "time"))


def follow_packet(action: FollowTwin, names: Sequence[str]) -> dict[str, Any]:
    """Build the trajectory_msgs/JointTrajectory of one set point for the twin."""
    return {
        "header": {"stamp": _ros_time(action.stamp), "frame_id": SENDER},
        "joint_names": list(names),
        "points": [
            {
                "positions": list(action.q),
                "velocities": list(action.qdot),
                "accelerations": list(action.qddot),
                "time_from_start": {"secs": 0, "nsecs": 0},
            }
        ],
    }


def end_packet(stamp: float) -> dict[str, Any]:
    """Build the trajectory_msgs/JointTrajectory without points that ends the twin's following; ``stamp`` is its ROS time."""
    return {"header": {"stamp": _ros_time(stamp), "frame_id": SENDER}, "joint_names": [], "points": []}


def command_packet(action: Perform, stamp: float) -> dict[str, Any]:
    """Build the scara_msgs/MotionCommand of an action for the twin; ``stamp`` is the twin's ROS time."""
    return {
        "header": {"stamp": _ros_time(stamp), "frame_id": SENDER},
        "command": _COMMANDS[action.do],
        "id": action.id,
        "reason": action.reason,
    }


def is_for_twin(do: Do) -> bool:
    """Return whether an action is a motion command to the twin."""
    return do in _COMMANDS


def _order(message: Mapping[str, Any], field: str, names: Sequence[str]) -> tuple[list[int], int]:
    """Return where each of our joints stands in the message, and how many joints it has."""
    given = message.get(field)
    if not isinstance(given, list):
        raise PacketError(f"{field}: missing")
    missing = [name for name in names if name not in given]
    if missing:
        raise PacketError(f"{field} = {_shown(given)}: {', '.join(missing)} missing")
    return [given.index(name) for name in names], len(given)


def _row(message: Mapping[str, Any], field: str, order: tuple[list[int], int]) -> Joints:
    """Return one list of numbers in the core's joint order."""
    values = message.get(field)
    places, count = order
    if not isinstance(values, list) or len(values) != count:
        raise PacketError(f"{field}: expected {count} numbers, got {_shown(values)}")
    row = tuple(values[place] for place in places)
    if not all(_is_finite(value) for value in row):
        raise PacketError(f"{field} = {_shown(list(row))}: not finite")
    return tuple(float(value) for value in row)


def _number(message: Mapping[str, Any], field: str) -> float:
    """Return one finite number."""
    value = message.get(field)
    if _is_finite(value):
        return float(value)
    raise PacketError(f"{field} = {_shown(value)}: expected a finite number")


def _is_finite(value: object) -> TypeGuard[float]:
    """Return whether a JSON value is a number that a double can hold; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


def _typed(message: Mapping[str, Any], field: str, kind: type[T]) -> T:
    """Return one field that must be of exactly this type."""
    value = message.get(field)
    if type(value) is not kind:
        raise PacketError(f"{field} = {_shown(value)}: expected {kind.__name__}")
    return value


def _shown(value: object) -> str:
    """Return a value for an error text, of bounded length."""
    if isinstance(value, int) and abs(value) > SECONDS:
        return "a huge number"
    try:
        return f"{value!r}"[:200]
    except ValueError:
        return "something with a huge number"


def _stamp(message: Mapping[str, Any]) -> float:
    """Return the header's stamp [s]."""
    header = message.get("header")
    if not isinstance(header, Mapping):
        raise PacketError("header: missing")
    return _time(header, "stamp")


def _time(message: Mapping[str, Any], field: str) -> float:
    """Return a ROS time or duration [s]."""
    value = message.get(field) if isinstance(message, Mapping) else None
    parts: list[Any] = [value.get(part) for part in ("secs", "nsecs")] if isinstance(value, Mapping) else []
    if not parts or not all(type(part) is int and abs(part) <= SECONDS for part in parts):
        raise PacketError(f"{field} = {_shown(value)}: expected secs and nsecs")
    return float(parts[0]) + float(parts[1]) * 1e-9


def _ros_time(t: float) -> dict[str, int]:
    """Split a time [s] into secs and nsecs."""
    nanoseconds = round(t * 1e9)
    return {"secs": nanoseconds // 1_000_000_000, "nsecs": nanoseconds % 1_000_000_000}
