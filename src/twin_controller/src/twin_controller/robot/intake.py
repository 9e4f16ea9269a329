"""What a sample of the robot has to pass before the core sees it, and what it says to the core."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
from scara_config import Robot
from scara_config.robot import Joint
from scara_control.joint_motion import JointMotion
from scara_control.limits import inside

from twin_controller.core.events import RealMeasured
from twin_controller.plausible import Plausibility, Reading, Verdict, judge
from twin_controller.robot_sample import (
    CLOCK_WRAP_MS,
    AlarmStatus,
    ControlType,
    ProgramStatus,
    RobotSample,
    SetpointError,
    WatchdogState,
)

PASSED_ON = ({*RobotSample.__struct_fields__} & {*RealMeasured.__struct_fields__}) - {
    "motion",
    "efforts",
}
"""What both have under one name; a sample's motion and efforts are of all joints."""


class Intake(msgspec.Struct, frozen=True):
    """What is known of the robot so far.

    Attributes:
        plausible: The last reading that was believed; begins anew with each connection.
        resting: Where the robot's joints were when the stream began or went on, those without a
            twin too [rad or m]. Empty while unknown. It outlives a connection.
        axes: Where the controller's axes were then, as read: robot.yaml need not name each. Empty
            where the protocol tells none.
    """

    plausible: Plausibility = Plausibility()
    resting: tuple[float, ...] = ()
    axes: tuple[float, ...] = ()


def begin(intake: Intake) -> Intake:
    """Return what is known after a new connection was made."""
    return Intake(resting=intake.resting, axes=intake.axes)


def take(
    intake: Intake, sample: RobotSample, received: float, joints: Sequence[Joint]
) -> tuple[Intake, Verdict]:
    """Judge one sample.

    Args:
        intake: What was known before.
        sample: All joints of robot.yaml, in its order.
        received: When the answer was complete, our clock [s].
        joints: Of robot.yaml.

    Returns:
        What is known now, and the verdict. ``plausible.reason`` says why a sample was refused.
    """
    reading = Reading(sample.motion, received)
    plausible, verdict = judge(intake.plausible, reading, joints, wrap=1e-3 * CLOCK_WRAP_MS)
    resting, axes = intake.resting, intake.axes
    # In a pause somebody may turn a joint at the pendant: the stream goes on from where it is then.
    streams = sample.control_type is ControlType.STREAM and not is_paused(sample)
    if verdict is Verdict.ACCEPTED and not (streams and resting):
        resting, axes = sample.motion.q, sample.axes
    return Intake(plausible, resting, axes), verdict


def whole_pose(
    intake: Intake, positions: Sequence[float], joints: Sequence[Joint]
) -> tuple[float, ...]:
    """Return a set point for all joints of the robot, and behind them where all its axes rest.

    Joints without a twin stay where they rest, and so do axes that robot.yaml does not name. A
    joint that was read a little outside its range stays at its edge: a set point may not be
    outside.

    Args:
        intake: Knows where they rest.
        positions: Of the twin's joints [rad or m].
        joints: Of robot.yaml.

    Raises:
        SetpointError: The robot's pose is not known yet, or the count is wrong.
    """
    if not intake.resting:
        raise SetpointError("set point: the robot's pose is not known yet")
    count = sum(joint.twin for joint in joints)
    if len(positions) != count:
        raise SetpointError(f"set point: {len(positions)} positions for {count} joints of the twin")
    twin = iter(positions)
    rests = zip(joints, inside(joints, intake.resting))
    return (*[next(twin) if joint.twin else rest for joint, rest in rests], *intake.axes)


def measured(
    sample: RobotSample,
    sent: float,
    received: float,
    robot: Robot,
    has_gripper: bool,
    program: str = "",
) -> RealMeasured:
    """Return what a believed sample says to the core: the twin's joints, and flags for signals.

    Args:
        sample: The sample.
        sent: When its request was sent [s].
        received: When its answer was complete [s].
        robot: robot.yaml.
        has_gripper: The robot has a suction gripper.
        program: The name of the program that runs or is paused, as it was told last; empty: none,
            or it was not told yet.
    """
    twin = [k for k, joint in enumerate(robot.joints) if joint.twin]
    return RealMeasured(
        now=received,
        sent=sent,
        received=received,
        motion=sample.motion.select(twin),
        own_program=sample.moved_by is ControlType.PROGRAM,
        program=program,
        streaming=sample.moved_by is ControlType.STREAM,
        paused="paused" in sample.outputs or "held" in sample.outputs,
        held="held" in sample.outputs,
        drives_on="sysrdy" in sample.outputs,
        fault="fault" in sample.outputs or heartbeat_lost(sample),
        held_there="panel_held" in sample.outputs,
        estop_pressed="panel_estop" in sample.outputs,
        speed_percent=sample.speed_percent,
        override_percent=float(sample.override),
        gripper="gripper" in sample.outputs if has_gripper else None,
        vacuum="vacuum" in sample.outputs,
        efforts=tuple([sample.efforts[k] for k in twin]) if sample.efforts else (),
        **{name: getattr(sample, name) for name in PASSED_ON},
    )


SLOW = 0.005
"""A joint below this part of its largest speed stands: readings are noisy. Our choice."""


def stands(before: JointMotion, motion: JointMotion, joints: Sequence[Joint]) -> bool:
    """Return whether no joint moved from one reading to the next, also where none tells speeds."""
    qdot: Sequence[float] = motion.qdot
    if not qdot:
        dt = motion.time - before.time
        if dt <= 0.0:
            return False
        qdot = [(new - old) / dt for old, new in zip(before.q, motion.q)]
    return all(abs(v) < SLOW * joint.velocity for v, joint in zip(qdot, joints))


def is_paused(sample: RobotSample) -> bool:
    """Return whether one of the robot's programs is paused, so that START would resume it."""
    return "paused" in sample.outputs


HEARTBEAT_LOST = "heartbeat lost: the robot's background program has ended what ran"
"""The robot raises no alarm for it: its own program can only take HOLD away."""


def heartbeat_lost(sample: RobotSample) -> bool:
    """Return whether the robot's watchdog holds it until RESET."""
    return sample.watchdog_state is WatchdogState.EXPIRED


def program_text(program: ProgramStatus) -> str:
    """Return the running or last program in words; empty if the robot names none."""
    if not program.name:
        return ""
    return f"{program.name} line {program.line} {program.state.name.lower()}"


WARNING = "WARN"
"""The maker's word for what is shown and stops nothing."""


def is_faulted(sample: RobotSample) -> bool:
    """Return whether the robot shows that something has stopped it."""
    return "fault" in sample.outputs or "sysrdy" not in sample.outputs or heartbeat_lost(sample)


def is_stopping(alarm: AlarmStatus, faulted: bool) -> bool:
    """Return whether the active alarm stops the robot; a warning does not.

    Args:
        alarm: The active alarm.
        faulted: What the robot shows beside it; counts where no text of the alarm tells it.
    """
    return alarm.severity != WARNING if alarm.severity else faulted


def alarm_text(alarm: AlarmStatus) -> str:
    """Return the active alarm in words; empty when there is no alarm."""
    if not alarm.facility:
        return ""
    text = f"{alarm.severity} {alarm.facility}-{alarm.number:03d} {alarm.message}".strip()
    return text + (f" ({alarm.cause})" if alarm.cause else "")
