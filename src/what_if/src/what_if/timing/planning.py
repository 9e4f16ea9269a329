"""Turn what is asked for into legs with times, by the planners that the cell moves with."""

from __future__ import annotations

import math

import numpy as np
from scara_config.programs.files import ProgramSteps
from scara_control.dynamics.effort import load_of
from scara_control.dynamics.planner import Planner
from scara_control.errors import JointLimitError, ScaraControlError
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.kinematics.tool_path import check_way, wanted_elbow
from scara_control.limits import LIMIT_TOLERANCE, check_limits
from scara_control.trajectory.goal import named_joints, plan_path

from what_if.errors import WhatIfError
from what_if.motions import JointTarget, Motion, Recorded, ToolTarget
from what_if.timing.law import move_leg
from what_if.timing.leg import Course, Leg, Planned, curved
from what_if.timing.programs import plan_program
from what_if.verdict import Cause, Reason
from what_if.world import World

SMOOTHING_S = 0.12
"""What was recorded is smoothed over this time before it is judged (our choice: the shortest ramps
of the three robots take as long)."""


MOST_SAMPLES = 20000
"""A trajectory that lasts longer than so many samples is looked at less often (our choice: 80 s at
4 ms). The slack between two samples grows with it, by the accelerations at the samples: what lies
wholly between two is bounded by trajectory_server's own limits alone."""


def plan(world: World, motion: Motion) -> Planned:
    """Plan a motion from where the joints are.

    Raises:
        WhatIfError: It cannot be a motion of this robot at all: a wrong count, an unknown joint.
    """
    try:
        if isinstance(motion, ProgramSteps):
            return plan_program(world, motion)
        if isinstance(motion, Setpoints):
            # Plan as trajectory_server does
            joints = world.cell.robot.twin_joints
            names = [joint.name for joint in joints]
            chosen = named_joints(joints, motion.names)
            columns = [names.index(joint.name) for joint in chosen]
            path = plan_path(chosen, tuple(world.q[k] for k in columns), motion.points)
            sample = max(world.cell.config.sample_ms * 1e-3, path.duration / MOST_SAMPLES)
            count = max(2, math.ceil(path.duration / sample) + 1)
            times = np.linspace(0.0, path.duration, count)
            rows = np.zeros((3, count, len(joints)))
            rows[0] = world.q
            for k, t in enumerate(times):
                at = path.at(float(t))
                rows[0, k, columns], rows[1, k, columns], rows[2, k, columns] = (
                    at.q,
                    at.qdot,
                    at.qddot,
                )
            course = Course(times, rows[0], rows[1], rows[2], np.arange(count, dtype=float))
            leg = curved(course, 0.0, "trajectory", world.lag.mean, world.lag.spread)
            return Planned((leg,), tuple(_too_much(world, course)))
        if isinstance(motion, Recorded):
            return _recorded(world, motion)
        return _move(world, motion)
    except JointLimitError as error:
        return _refused(Cause.LIMIT, str(error))
    except ScaraControlError as error:
        cause = Cause.REACH if isinstance(motion, ToolTarget) else Cause.LIMIT
        return _refused(cause, str(error))


def _refused(cause: Cause, text: str) -> Planned:
    return Planned((), (Reason(cause, 0.0, "", None, text),))


def _move(world: World, motion: ToolTarget | JointTarget) -> Planned:
    """Plan as joint_pose_controller does; the robot follows by its lag."""
    joints, settings = world.cell.robot.twin_joints, world.cell.motion.move
    percent = motion.speed_percent or settings.default_speed_percent
    if not 1.0 <= percent <= 100.0:
        raise WhatIfError(f"speed_percent = {percent:g}: is neither 0 (default) nor in [1, 100]")
    target = _destination(world, motion)
    check_limits(joints, target)
    places = (motion.via, motion.corner_mm) if isinstance(motion, JointTarget) else ((), 0.0)
    way = check_way(joints, motion.path, places[0], motion.speed_mm_s, places[1])
    planner = Planner(joints, world.cell.kinematics.tool)
    if (world.payload is not None and world.payload.mass_kg) or world.held:
        planner.load = load_of(world.models[bool(world.held)], joints, settings.effort_percent)
    planned = min(percent, world.cell.cap_percent)
    path = planner.move(JointMotion.at_rest(world.q), target, planned, way)
    # As joint_pose_controller does: the cap in force slows all of a path down, its ramps too.
    scale = min(1.0, world.cap_percent / planned)
    reasons = []
    if percent > world.cap_percent:
        text = f"{percent:g} % is asked for; the robot gets {world.cap_percent:g} %, its cap"
        reasons.append(Reason(Cause.SPEED, 0.0, "", None, text))
    if path.share < 1.0:
        text = f"the payload leaves {100.0 * path.share:.0f} % of the joints' acceleration"
        reasons.append(Reason(Cause.EFFORT, 0.0, "", None, text))
    # Look at a path at chosen times
    sample = world.cell.config.sample_ms * 1e-3
    count = max(2, math.ceil(path.duration / scale / sample) + 1)
    at = np.linspace(0.0, path.duration, count)
    motions = [path.at(float(t)) for t in at]
    q = np.array([motion.q for motion in motions])
    qdot = scale * np.array([motion.qdot for motion in motions])
    qddot = scale**2 * np.array([motion.qddot for motion in motions])
    times = at / scale
    step = f"{motion.path or 'move'} at {percent:g} %"
    if path.corners:
        course = Course(times, q, qdot, qddot, np.arange(count, dtype=float))
        leg = curved(course, 0.0, step, world.lag.mean, world.lag.spread)
        return Planned((leg,), tuple(reasons))
    # A joint move from rest is straight: the way is where it is on it.
    whole = q[-1] - q[0]
    column = int(np.argmax(np.abs(whole)))
    far = whole[column]
    u = (q[:, column] - q[0, column]) / far if far else np.linspace(0.0, 1.0, count)
    course = Course(times, q, qdot, qddot, np.clip(u, 0.0, 1.0))
    leg = move_leg(course, 0.0, step, world.lag.mean, world.lag.spread)
    return Planned((leg,), tuple(reasons))


def _destination(world: World, motion: ToolTarget | JointTarget) -> tuple[float, ...]:
    """Return the joint positions at the end.

    Raises:
        ScaraControlError: The point is out of reach, or there is no such elbow.
        WhatIfError: The robot cannot turn its tool.
    """
    if isinstance(motion, JointTarget):
        return motion.q
    names = [joint.name for joint in world.cell.robot.twin_joints]
    columns = [names.index(joint.name) for joint in world.cell.robot.arm_joints]
    seed = [world.q[column] for column in columns]
    tool = world.cell.kinematics.tool
    elbow = wanted_elbow(tool, motion.elbow, motion.path, seed)
    yaw = motion.yaw if tool.turns else None
    answer = tool.inverse(motion.x, motion.y, motion.z, elbow, seed, yaw)
    # What does not belong to the arm, such as the table, stays where it is.
    q = list(world.q)
    for column, value in zip(columns, answer.chosen.q):
        q[column] = value
    if motion.yaw is not None and yaw is None:
        # The twin has no wrist. Refuse a yaw that the real robot's own last joint cannot reach.
        robot = world.cell.robot
        own = [
            (joint, joint.screw_axis[2])
            for joint in robot.joints
            if not joint.twin and joint.screw_axis is not None
        ]
        if robot.geometry is None or not own:
            raise WhatIfError(
                f"yaw: {robot.name} has no joint that turns the tool about the vertical"
            )
        wrist, up = own[-1]
        left = math.remainder(motion.yaw - tool.yaw(answer.chosen.q), math.tau)
        turn, low = math.copysign(1.0, up) * left, wrist.lower - LIMIT_TOLERANCE
        # A turn more or less is the same yaw: the first one that is not below the range decides.
        first = low + (turn - low) % math.tau
        check_limits([wrist], [first if first <= wrist.upper + LIMIT_TOLERANCE else turn])
    return tuple(q)


def _recorded(world: World, motion: Recorded) -> Planned:
    """Take the way of a bag, smoothed: its positions, speeds and accelerations.

    Raises:
        WhatIfError: A joint is unknown, there are too few positions, or they last too short a time.
    """
    from scipy.signal import savgol_filter  # 43 MB, which a judge of moves need not have

    names = [joint.name for joint in world.cell.robot.twin_joints]
    way = motion.way
    unknown = sorted(set(way.names) - set(names))
    if unknown or len(way.points) < 2:
        what = f"unknown joints {', '.join(unknown)}" if unknown else "fewer than two positions"
        raise WhatIfError(f"the recorded way has {what}: expected {', '.join(names)}")
    sample = world.cell.config.sample_ms * 1e-3
    times = np.arange(way.times[0], way.times[-1], sample)
    if len(times) < 2:
        seconds = way.times[-1] - way.times[0]
        raise WhatIfError(f"the recorded way lasts {seconds:g} s: expected more than {sample:g} s")
    q = np.tile(np.array(world.q), (len(times), 1))
    for name, column in zip(way.names, zip(*(point.q for point in way.points))):
        q[:, names.index(name)] = np.interp(times, way.times, column)
    # Odd, so that the window has a middle, and no longer than what was recorded.
    window = min(2 * int(0.5 * SMOOTHING_S / sample) + 1, len(times) - (len(times) + 1) % 2)
    order = min(3, window - 1)
    smooth, qdot, qddot = (
        savgol_filter(q, window, order, deriv=d, delta=sample, axis=0) for d in (0, 1, 2)
    )
    u = np.arange(len(times), dtype=float)
    course = Course(times - times[0], smooth, qdot, qddot, u)
    legs, begin = [], 0
    for when, on in motion.grips:
        # A piece has at least one step, however soon the next switch comes.
        end = int(np.clip(np.searchsorted(times, when), begin + 1, len(times) - 1))
        if end > begin:  # at the end of the way nothing lies between two switches
            legs.append(_part(course, begin, end))
        legs.append(Leg(float(course.times[end]), 0.0, "", grip=on))
        begin = end
    if begin < len(times) - 1:
        legs.append(_part(course, begin, len(times) - 1))
    return Planned(tuple(legs), tuple(_too_much(world, course)))


def _part(course: Course, begin: int, end: int) -> Leg:
    """Return a piece of what was recorded."""
    cut = slice(begin, end + 1)
    piece = Course(
        course.times[cut] - course.times[begin],
        course.q[cut],
        course.qdot[cut],
        course.qddot[cut],
        np.arange(end + 1 - begin, dtype=float),
    )
    return curved(piece, float(course.times[begin]), "recorded way", 0.0)


def _too_much(world: World, course: Course) -> list[Reason]:
    """Return the first joint that leaves its range or is too fast."""
    found = []
    for k, joint in enumerate(world.cell.robot.twin_joints):
        for values, low, high, per in (
            (course.q[:, k], joint.lower, joint.upper, ""),
            (course.qdot[:, k], -joint.velocity, joint.velocity, "/s"),
        ):
            slack = 1e-6 + 1e-4 * (high - low)
            outside = np.flatnonzero((values < low - slack) | (values > high + slack))
            if outside.size:
                at = int(outside[0])
                text = (
                    f"{joint.name} = {values[at] / joint.scale:.2f} {joint.unit}{per} is outside "
                    f"[{low / joint.scale:.6g}, {high / joint.scale:.6g}]"
                )
                found.append(Reason(Cause.LIMIT, float(course.times[at]), "", None, text))
    return sorted(found, key=lambda reason: reason.time_s)
