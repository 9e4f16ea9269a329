"""What can be sent: one small function for each deed; names and arguments stand in names.py."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from fanuc_emulator.pendant.pendant_link_io import PendantLink

from harness.storm.hands import PERIOD_S, Attempt, Hands, joint
from harness.storm.names import JOINTS

Do = Callable[..., None]
DEEDS: dict[str, Do] = {}
REAL_ONLY = ("real",)
PULSES = {
    "pendant program": "panel_run",
    "pendant resume": "panel_start",
    "pendant reset": "panel_reset",
    "pendant abort": "panel_abort",
}
BUTTONS = {"press hold": ("panel_hold",), "press emergency stop": ("panel_imstp",)}
RELEASED = {"release buttons": ("panel_imstp", "panel_hold")}


def deed(*names: str) -> Callable[[Do], Do]:
    """Enter a function under these names."""

    def enter(function: Do) -> Do:
        DEEDS.update(dict.fromkeys(names, function))
        return function

    return enter


@deed("STOP", "ESTOP", "PAUSE", "RESET", "RESUME", "ALIGN", "ACKNOWLEDGE")
def plain_command(hands: Hands, attempt: Attempt) -> None:
    """Give the twin controller a command without arguments."""
    _command(hands, attempt, attempt.name)


@deed("SPEED", "HOME")
def command_with_speed(hands: Hands, attempt: Attempt, percent: float) -> None:
    """Cap the speed, or go home with it."""
    _command(hands, attempt, attempt.name, speed_percent=percent)


@deed("MOVE", "move_to", "gateway MOVE", "gateway move_to")
def move(hands: Hands, attempt: Attempt, x: float, y: float, z: float, percent: float) -> None:
    """Let the operator move both to a point, or move the twin; over the gateway as a stranger."""
    call = _over_gateway if attempt.name.startswith("gateway") else Hands.call
    attempt.waits = attempt.name.endswith("move_to")
    service = "move_to" if attempt.waits else "twin_controller/command"
    fields = {} if attempt.waits else {"command": "MOVE", "at_once": attempt.name == "MOVE"}
    call(hands, attempt, service, **fields, x=x, y=y, z=z, speed_percent=percent)


@deed("MOVE_JOINTS", "joint move")
def move_joints(hands: Hands, attempt: Attempt, *pose: float) -> None:
    """Move both, or the twin, to a pose; its last number is the speed."""
    fields = {"joint_positions": list(pose[:-1]), "speed_percent": pose[-1]}
    if attempt.name == "MOVE_JOINTS":
        _command(hands, attempt, "MOVE_JOINTS", **fields)
    else:
        attempt.waits = True
        hands.call(attempt, "joint_pose_controller/move", **fields)


def _command(hands: Hands, attempt: Attempt, command: str, **fields: Any) -> None:
    fields = {"command": command, "at_once": True, **fields}
    hands.call(attempt, "twin_controller/command", **fields)


@deed("pose target")
def pose_target(hands: Hands, attempt: Attempt, *pose: float) -> None:
    """Move the twin's joints without an answer."""
    from sensor_msgs.msg import JointState

    message = JointState(name=list(JOINTS), position=list(pose[:-1]), velocity=[pose[-1]])
    hands.publish(attempt, "joint_pose_controller/target", message)


@deed("joint velocity")
def joint_velocity(hands: Hands, attempt: Attempt, name: str, part: float, seconds: float) -> None:
    """Command one joint of the simulator directly, again and again."""
    from std_msgs.msg import Float64

    for _ in _repeated(seconds):
        speed = Float64(part * joint(name).velocity)
        hands.publish(attempt, f"twin/{name}_velocity_controller/command", speed)


@deed("joint position")
def joint_position(hands: Hands, attempt: Attempt, name: str, part: float, seconds: float) -> None:
    """Send one joint of the simulator to a place around the middle of its range."""
    from std_msgs.msg import Float64

    at = joint(name)
    goal = 0.5 * (at.lower + at.upper) + 0.4 * part * (at.upper - at.lower)
    hands.publish(attempt, f"twin/{name}_position_controller/command", Float64(goal))


@deed("jog")
def jog(hands: Hands, attempt: Attempt, name: str, part: float, seconds: float) -> None:
    """Jog the twin."""
    from control_msgs.msg import JointJog

    for _ in _repeated(seconds):
        message = JointJog(joint_names=[name], velocities=[part * joint(name).velocity])
        hands.publish(attempt, "joint_vel_controller/command", message)


@deed("trajectory")
def trajectory(hands: Hands, attempt: Attempt, *pose: float) -> None:
    """Send a goal of the trajectory action; its last number decides how long it takes."""
    import rospy
    from trajectory_msgs.msg import JointTrajectoryPoint

    from control_msgs.msg import FollowJointTrajectoryActionGoal

    action = FollowJointTrajectoryActionGoal()
    action.header.stamp = action.goal_id.stamp = rospy.Time.now()
    action.goal_id.id = f"storm {time.time():.6f}"
    seconds = 1.0 + 20.0 / pose[-1]
    point = JointTrajectoryPoint(
        positions=list(pose[:-1]), time_from_start=rospy.Duration.from_sec(seconds)
    )
    action.goal.trajectory.joint_names = list(JOINTS)
    action.goal.trajectory.points = [point]
    hands.publish(attempt, "joint_trajectory_action/goal", action)


@deed("twin's STOP", "twin's PAUSE", "twin's RESET", "twin's RESUME")
def twins_button(hands: Hands, attempt: Attempt) -> None:
    """Command everything that moves the twin, on the twin's side."""
    from scara_msgs.msg import MotionCommand

    word = attempt.name.removeprefix("twin's ")
    number = round(time.time() * 1e3) % 2**31
    message = MotionCommand(command=getattr(MotionCommand, word), id=number, reason="the storm")
    hands.publish(attempt, "motion_command", message)


@deed("gateway STOP", "gateway PAUSE")
def gateway_command(hands: Hands, attempt: Attempt) -> None:
    """Command as a client of the gateway."""
    command = attempt.name.removeprefix("gateway ")
    _over_gateway(hands, attempt, "twin_controller/command", command=command)


def _over_gateway(hands: Hands, attempt: Attempt, service: str, **fields: Any) -> None:
    """Call as a client without a token: a stranger beside who holds control."""
    with hands.gateway() as client:
        attempt.mark()
        packet = client.ask(op="call_service", service=service, args=fields)
    values = packet.get("values")
    if packet.get("result") is not True or not isinstance(values, dict):
        attempt.close(False, str(values))
        return
    attempt.close(bool(values.get("success")), str(values.get("message")))


@deed("gateway jog")
def gateway_jog(hands: Hands, attempt: Attempt, name: str, part: float, seconds: float) -> None:
    """Jog the twin as a client of the gateway."""
    topic = "joint_vel_controller/command"
    message = {"joint_names": [name], "velocities": [part * joint(name).velocity]}
    with hands.gateway() as client:
        client.say(op="advertise", topic=topic, type="control_msgs/JointJog")
        for _ in _repeated(seconds):
            attempt.mark()
            client.say(op="publish", topic=topic, msg=message)


@deed("page STOP", "page ESTOP")
def page_stop(hands: Hands, attempt: Attempt) -> None:
    """Press STOP or E-STOP on the page."""
    press = hands.page.press()
    hands.page.open()
    attempt.mark()
    hands.page.send(stop=attempt.name.removeprefix("page "), press=press)
    answer = hands.page.stopped(press)
    if answer is not None:
        attempt.close(bool(answer["confirmed"] and answer["success"]), str(answer["text"]))


@deed("page jog")
def page_jog(hands: Hands, attempt: Attempt, name: str, part: float, seconds: float) -> None:
    """Hold a jog button of the page."""
    press = hands.page.press()
    hands.page.open()
    fields = {"joint": name, "direction": 1 if part > 0.0 else -1, "percent": 100.0 * abs(part)}
    for _ in _repeated(seconds):
        attempt.mark()
        hands.page.send(hold=press, **fields)
    hands.page.send(release=press)
    attempt.said = hands.page.refused.get(press, "")


@deed("pendant program", "pendant resume", "pendant reset", "pendant abort")
def pendant_pulse(hands: Hands, attempt: Attempt, number: str = "") -> None:
    """Start a program, let a held one go on, reset the alarms, or end the program."""
    signal = PULSES[attempt.name] + number
    with _at_the_robot(hands, attempt) as pendant:
        pendant.pulse(signal)
        if signal != "panel_abort":
            attempt.mark()
    if signal == "panel_abort":
        attempt.close(True, "the signal was set")


@deed("press hold", "press emergency stop", "release buttons", "pendant override")
def pendant_setting(hands: Hands, attempt: Attempt, percent: float = 0.0) -> None:
    """Press a button at the robot, which stays pressed; release both; or turn the override."""
    pressed = BUTTONS.get(attempt.name, ())
    with _at_the_robot(hands, attempt) as pendant:
        if attempt.name == "pendant override":
            pendant.write("override", [int(percent)])
        for button in pressed or RELEASED.get(attempt.name, ()):
            pendant.set_signal(button, not pressed)
    attempt.close(True, "it is set")


@contextmanager
def _at_the_robot(hands: Hands, attempt: Attempt) -> Iterator[PendantLink]:
    """Give the robot's pendant, which commands the robot alone; note when something leaves."""
    attempt.sides = REAL_ONLY
    with hands.pendant() as pendant:
        attempt.mark()
        yield pendant


def _repeated(seconds: float) -> Iterator[None]:
    """Yield in the rhythm of a held button for ``seconds``."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        yield
        time.sleep(PERIOD_S)
