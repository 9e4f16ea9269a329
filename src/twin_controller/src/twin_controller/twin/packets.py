"""The twin's ROS messages as rosbridge carries them, converted to inputs and from actions.

Everything that arrives is checked here: names, counts, finite numbers. What does not fit raises
PacketError, is counted by the shell and never reaches the core.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scara_config.robot import Joint
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.joint_track import SetpointError, check_times

from twin_controller.core.actions import Command, FollowTwin, MoveTwin, SendTwin
from twin_controller.core.events import ClockProbe, TwinGripper, TwinMeasured, TwinMotion, TwinPlan
from twin_controller.plausible import TWIN_ACCELERATION, Plausibility, Reading, Verdict, judge
from twin_controller.twin.fields import (
    PacketError,
    number,
    order_of,
    ros_time,
    row,
    row_or_zeros,
    rows_of,
    shown,
    stamp_of,
    time_of,
    typed,
)
from twin_controller.twin.held_joints import HeldJoints

JOINT_STATES = "twin/joint_states"
JOINT_SETPOINTS = "twin/joint_setpoints"
JOG_AHEAD = "joint_vel_controller/ahead"
MOTION_STATE = "joint_pose_controller/state"
GRIPPER = "twin/gripper"
FOLLOW = "joint_pose_controller/follow"
SPEED_LIMIT = "joint_pose_controller/speed_limit_percent"
MOTION_COMMAND = "motion_command"
SENDER = "twin_controller"
MOTION_STATES = (
    "idle",
    "announcing",
    "moving",
    "following",
    "pausing",
    "paused",
    "stopping",
    "estopped",
)
RANGE_MARGIN = 0.02
"""How far outside its range, as a part of it, a joint of the twin may be read.

Physics gives way at a limit."""
_COMMANDS = {
    Command.STOP_TWIN: 1,
    Command.PAUSE_TWIN: 2,
    Command.RESUME_TWIN: 3,
    Command.ESTOP_TWIN: 4,
    Command.YIELD_TWIN: 6,
    Command.RESET_TWIN: 5,
}


def twin_measured(message: Mapping[str, Any], names: Sequence[str], now: float) -> TwinMeasured:
    """Convert a sensor_msgs/JointState.

    Args:
        message: The message as parsed JSON.
        names: The twin's joints in the core's order.
        now: When it arrived [s].

    Raises:
        PacketError: A joint is missing, a count is wrong, a value is not finite.
    """
    order = order_of(message, "name", names)
    q, qdot = row(message, "position", order), row(message, "velocity", order)
    return TwinMeasured(now, JointMotion.measured(q, qdot, stamp_of(message)))


def judge_measured(
    state: Plausibility, event: TwinMeasured, joints: Sequence[Joint]
) -> tuple[Plausibility, Verdict]:
    """Judge one joint state; ``reason`` of the new state says why it was refused.

    Raises:
        PacketError: A joint is far outside its range.
    """
    for joint, q in zip(joints, event.motion.q):
        margin = RANGE_MARGIN * (joint.upper - joint.lower)
        if not joint.lower - margin <= q <= joint.upper + margin:
            limits = f"[{joint.lower:.6g}, {joint.upper:.6g}]"
            raise PacketError(f"position of {joint.name} = {q:g} is outside {limits}")
    return judge(state, Reading(event.motion, event.now), joints, TWIN_ACCELERATION)


def coming_setpoints(message: Mapping[str, Any], names: Sequence[str]) -> Setpoints:
    """Convert a trajectory_msgs/JointTrajectory of coming set points, of some joints or all.

    Velocities and accelerations that were left out are zeros.

    Args:
        message: The message as parsed JSON.
        names: The twin's joints in the core's order; others are left away.

    Raises:
        PacketError: None of our joints is named, a count is wrong, a value is not finite.
    """
    given = message.get("joint_names")
    known = [name for name in names if name in given] if isinstance(given, list) else []
    order = order_of(message, "joint_names", known or names)
    points = message.get("points")
    if not isinstance(points, list) or not points:
        raise PacketError("points: empty")
    times = [time_of(point, "time_from_start") for point in points]
    motions = tuple(
        JointMotion(
            row(point, "positions", order),
            row_or_zeros(point, "velocities", order),
            row_or_zeros(point, "accelerations", order),
            at,
        )
        for at, point in zip(times, points)
    )
    return Setpoints(tuple(known), motions)


def twin_plan(
    message: Mapping[str, Any],
    names: Sequence[str],
    now: float,
    held: HeldJoints | None = None,
    jog: bool = False,
) -> TwinPlan:
    """Convert a trajectory_msgs/JointTrajectory of coming set points.

    Args:
        message: The message as parsed JSON.
        names: The twin's joints in the core's order.
        now: When it arrived [s].
        held: Says what joints hold that are not named; None: all have to be named.
        jog: It tells of a jog, not of set points.

    Raises:
        PacketError: A joint is missing and nobody knows what it holds, a count is wrong, a value is
            not finite, times do not increase.
    """
    if held is None:
        order_of(message, "joint_names", names)
    given = coming_setpoints(message, names)
    whole = given if held is None else held.complete(given, now)
    return plan_of(whole, stamp_of(message), now, jog)


def plan_of(setpoints: Setpoints, stamp: float, now: float, jog: bool = False) -> TwinPlan:
    """Return set points of all joints as the core takes them; their times count from ``stamp``.

    Raises:
        PacketError: Times do not increase.
    """
    try:
        check_times(setpoints.times)
    except SetpointError as error:
        raise PacketError(f"points: {error}") from error
    return TwinPlan(now, stamp, setpoints, jog)


def twin_motion(message: Mapping[str, Any], names: Sequence[str], now: float) -> TwinMotion:
    """Convert a scara_msgs/MotionState.

    Raises:
        PacketError: A field is missing, of the wrong type, or the state is unknown.
    """
    state = typed(message, "state", str)
    if state not in MOTION_STATES:
        raise PacketError(f"state = {state[:40]!r}: expected one of {', '.join(MOTION_STATES)}")
    command_id = typed(message, "last_command_id", int)
    if not 0 <= command_id < 1 << 32:
        raise PacketError(f"last_command_id = {shown(command_id)}: expected a uint32")
    return TwinMotion(
        now,
        state,
        number(message, "speed_requested_percent"),
        number(message, "speed_applied_percent"),
        number(message, "speed_limit_percent"),
        command_id,
        typed(message, "standing_still", bool),
        typed(message, "message", str),
        row(message, "target", order_of(message, "name", names)) if message.get("target") else (),
        number(message, "peak_percent"),
        rows_of(message, "way", order_of(message, "name", names)) if message.get("way") else (),
    )


def twin_gripper(message: Mapping[str, Any], now: float) -> TwinGripper:
    """Convert a scara_msgs/GripperState.

    Raises:
        PacketError: A field is missing or of the wrong type.
    """
    return TwinGripper(
        now,
        typed(message, "commanded", bool),
        typed(message, "holding", bool),
        typed(message, "part", str),
        typed(message, "touches", str),
    )


def clock_probe(values: Mapping[str, Any], sent: float, received: float) -> ClockProbe:
    """Convert the answer of /rosapi/get_time.

    Raises:
        PacketError: There is no time in it.
    """
    return ClockProbe(received, sent, received, time_of(values, "time"))


def follow_packet(action: FollowTwin, names: Sequence[str]) -> dict[str, Any]:
    """Build the trajectory_msgs/JointTrajectory of a set point for the twin, and the way on."""
    return {
        "header": {"stamp": ros_time(action.stamp), "frame_id": SENDER},
        "joint_names": list(names),
        "points": [
            {
                "positions": list(point.q),
                "velocities": list(point.qdot),
                "accelerations": list(point.qddot),
                "time_from_start": ros_time(point.time),
            }
            for point in action.points
        ],
    }


def end_packet(stamp: float) -> dict[str, Any]:
    """Build the trajectory_msgs/JointTrajectory without points that ends the twin's following.

    ``stamp`` is the twin's ROS time.
    """
    return {
        "header": {"stamp": ros_time(stamp), "frame_id": SENDER},
        "joint_names": [],
        "points": [],
    }


def command_packet(action: SendTwin, stamp: float, asked: float = 0.0) -> dict[str, Any]:
    """Build the scara_msgs/MotionCommand of an action.

    Args:
        action: What the twin is told.
        stamp: The twin's ROS time.
        asked: When it was decided, by the monotonic clock of the twin's machine [s]; 0: not known.
    """
    return {
        "header": {"stamp": ros_time(stamp), "frame_id": SENDER},
        "command": _COMMANDS[action.command],
        "id": action.id,
        "reason": action.reason,
        "asked": asked,
    }


ServiceCall = tuple[str, dict[str, Any]]
"""One of the twin's services, and the fields of its request."""


def move_call(action: MoveTwin, names: Sequence[str], same_clock: bool = True) -> ServiceCall:
    """Return the call that moves the twin: to a point by ``move_to``, or to joint positions.

    Args:
        action: Where to, and when that was asked for.
        names: The twin's joints.
        same_clock: The twin's nodes run on this machine: they can be told when.
    """
    asked = {
        "asked": action.asked if same_clock else 0.0,
        "path": action.path,
        "speed_mm_s": action.speed_mm_s,
    }
    if action.command == "MOVE":
        x, y, z = action.target
        point = {"x": x, "y": y, "z": z}
        speed = {"speed_percent": action.speed_percent, "elbow": action.elbow}
        yaw = {} if action.yaw is None else {"has_yaw": True, "yaw": action.yaw}
        return "move_to", point | speed | asked | yaw
    arguments = {
        "joint_names": list(names),
        "joint_positions": list(action.target),
        "speed_percent": action.speed_percent,
    }
    passed = {"via": list(action.via), "corner_mm": action.corner_mm}
    return "joint_pose_controller/move", arguments | asked | passed


def gripper_call(on: bool) -> ServiceCall:
    """Return the call that switches the twin's suction."""
    return "gripper", {"data": on}


def answer(result: bool, values: object) -> tuple[bool, str]:
    """Return what the answer to a call says: whether it succeeded, and a text.

    Args:
        result: The twin has answered.
        values: Its answer, or why there is none.
    """
    if not result or not isinstance(values, dict):
        return False, str(values)
    return bool(values.get("success")), str(values.get("message", ""))
