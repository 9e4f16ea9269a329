"""A short recording, as the recorder writes it: the pair at rest, a program, a STOP."""

from __future__ import annotations

import json
import math
from pathlib import Path

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point
from scara_config import Robot
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from scara_msgs.msg import Audit, Decision, LinkState, RobotData, TwinControllerState

START = 1_767_225_600.0
"""Time of receipt of the first message [s]."""
LENGTH_S, MOVES_S, STOPS_S = 12.0, 4.0, 8.0
"""How long it is, when the real robot begins to lead, and when STOP ends that [s]."""
RATE_HZ = 20
REASON = "the person at cell 7 pressed STOP"
WARNED = "set point kept inside its limits"
EFFORT = 7.5


def joint_1_deg(after: float) -> float:
    """Return where joint 1 of both robots is, ``after`` [s] behind the start."""
    return 10.0 * (min(max(after, MOVES_S), STOPS_S) - MOVES_S)


def mode_at(after: float) -> str:
    """Return the mode, ``after`` [s] behind the start."""
    if after < MOVES_S:
        return TwinControllerState.IDLE
    leads, stopped = TwinControllerState.REAL_LEADS, TwinControllerState.STOPPED
    return leads if after < STOPS_S else stopped


def write_recording(path: Path, robot: Robot, name: str = "", silent: float = LENGTH_S) -> Path:
    """Write a recording of ``robot``; it says ``name`` if one is given.

    From ``silent`` [s] behind the start the twin controller says nothing more.
    """
    with rosbag.Bag(str(path), "w") as bag:
        text = json.dumps({"robot.yaml": f"name: {name or robot.name}\n"})
        _put(bag, "twin_controller/configuration", String(text), 0.0)
        for number in range(int(LENGTH_S * RATE_HZ) + 1):
            after = number / RATE_HZ
            if after <= silent:
                _put(bag, "twin_controller/state", state(robot, after), after)
            _put(bag, "real/robot_data", _package(after), after)
            _put(bag, "twin/joint_states", _joints(robot, after), after)
            if number % RATE_HZ == 0:
                _put(bag, "twin/parts", _parts(after), after)
                _put(bag, "/diagnostics", _diagnostics(after), after)
        for after, before, why in (
            (MOVES_S, 0.0, "the real robot moved: the twin follows"),
            (STOPS_S, MOVES_S, REASON),
        ):
            _put(bag, "twin_controller/decisions", _decision(after, before, why), after)
        # The recorder's stamps never run backwards; rosbag sorts by its index.
        _put(bag, "twin_controller/audit", _audit("/gateway/operator", "STOP", REASON), STOPS_S)
        _put(bag, "twin_controller/audit", _audit("twin_controller", "STOP_REAL", ""), STOPS_S)
        _put(bag, "experiment/marker", String("start of a test"), 0.5)
    return path


def _put(bag: rosbag.Bag, topic: str, message: object, after: float) -> None:
    bag.write(topic if topic.startswith("/") else f"/cell/{topic}", message, time(after))


def time(after: float) -> rospy.Time:
    """Return the time ``after`` [s] behind the start."""
    return rospy.Time.from_sec(START + after)


def state(robot: Robot, after: float) -> TwinControllerState:
    """Return what the twin controller says, ``after`` [s] behind the start."""
    joints = robot.twin_joints
    position = [joint_1_deg(after)] + [0.0] * (len(joints) - 1)
    mode = mode_at(after)
    message = TwinControllerState(mode=mode, why=REASON if after >= STOPS_S else "")
    message.leader = "real" if mode == TwinControllerState.REAL_LEADS else ""
    message.name, message.unit = [j.name for j in joints], [j.unit for j in joints]
    message.real_position = message.twin_position = position
    message.deviation = [0.0] * len(joints)
    message.real_tool = message.twin_tool = Point(math.nan, math.nan, math.nan)
    message.command, message.refused = ["MOVE"], ["the controller stopped"]
    message.links = [LinkState(name=name, connected=True, age=0.004) for name in ("real", "twin")]
    return message


def _package(after: float) -> RobotData:
    running = MOVES_S <= after < STOPS_S
    return RobotData(
        control_type="program", running=running, ready=True, program="ARTICLE" if running else ""
    )


def _joints(robot: Robot, after: float) -> JointState:
    joints = robot.twin_joints
    first, *others = joints
    position = [joint_1_deg(after) * first.scale] + [0.0] * len(others)
    effort = [EFFORT] + [0.0] * len(others)
    return JointState(name=[joint.name for joint in joints], position=position, effort=effort)


def _parts(after: float) -> MarkerArray:
    marker = Marker(type=Marker.CYLINDER, action=Marker.ADD, ns="part_1")
    marker.pose.position.x = 0.3 + 0.01 * after
    marker.scale.x = marker.scale.y = marker.scale.z = 0.04
    marker.pose.orientation.w = marker.color.r = 1.0
    return MarkerArray([marker])


def _diagnostics(after: float) -> DiagnosticArray:
    level = DiagnosticStatus.WARN if 5.0 <= after < 7.0 else DiagnosticStatus.OK
    return DiagnosticArray(
        status=[DiagnosticStatus(level=level, name="simulator: physics", message=WARNED)]
    )


def _decision(after: float, before: float, why: str) -> Decision:
    message = Decision(mode_before=mode_at(before), mode_after=mode_at(after), why=why)
    message.header.stamp = time(after)
    return message


def _audit(who: str, what: str, outcome: str) -> Audit:
    return Audit(who=who, what=what, success=True, outcome=outcome)
