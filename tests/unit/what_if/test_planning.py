"""A motion in time: its samples, its pieces and what it asks for, at the bounds."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from harness.second_world.planting import moves
from scara_config.programs.files import ProgramSteps
from scara_config.programs.steps import GripperStep, WaitStep
from scara_control.joint_motion import JointMotion, Setpoints
from what_if.errors import WhatIfError
from what_if.judging import judge
from what_if.learning.course import predict
from what_if.motions import JointTarget, Recorded, ToolTarget, point_of
from what_if.timing.leg import Course, curved
from what_if.timing.planning import SMOOTHING_S, plan
from what_if.timing.use import use_of
from what_if.verdict import Cause
from what_if.world import Lag, World

HOME = (0.0, 0.0, -0.16, 0.0)
THERE = (1.0, 0.4, -0.1, 0.2)


def test_a_text_is_a_point_of_three_or_four_finite_numbers() -> None:
    """Two say no height, and five nothing that anybody knows; a program's name is no point."""
    assert point_of("0.5,-.1, 0.2") == ToolTarget(0.5, -0.1, 0.2) and point_of("a.bag") is None
    assert point_of("1,2,3,90", 30.0, "lefty") == ToolTarget(1, 2, 3, math.pi / 2, "lefty", 30.0)
    for text in ("1", "1,2", "1,2,3,4,5", "1e999,0,0"):
        with pytest.raises(WhatIfError, match="expected x,y,z"):
            point_of(text)


def test_a_joint_move_is_told_by_its_speed(world: World) -> None:
    """In the words of whoever reads the verdict."""
    legs = plan(world, JointTarget(THERE, 30.0)).legs
    assert [leg.step for leg in legs] == ["move at 30 %"]


def test_a_joint_move_is_straight_and_its_samples_say_how_far(world: World) -> None:
    """From 0 where it begins to 1 at its end."""
    (leg,) = plan(world, JointTarget(THERE, 30.0)).legs
    q, u = leg.course.q, leg.course.u
    assert (u[0], u[-1]) == (0.0, 1.0)
    assert q == pytest.approx(q[0] + u[:, None] * (q[-1] - q[0]), abs=1e-9)


def recorded(rows: list[tuple[float, ...]], seconds: float, *grips: tuple[float, bool]) -> Recorded:
    """Return what a bag holds of joint positions at even times."""
    points = [JointMotion(row, (), ()) for row in rows]
    names = ("joint_1", "joint_2", "joint_3", "table_joint")
    return Recorded(
        Setpoints.due(names, np.linspace(0, seconds, len(rows)).tolist(), points), grips
    )


def test_a_recorded_way_is_cut_where_the_suction_was_switched(world: World) -> None:
    """At the switch's own time; behind one at the end comes no piece any more."""
    for last, behind in ((1.5, [None]), (2.5, [])):
        legs = plan(world, recorded([HOME, THERE], 2.0, (0.5, True), (last, False))).legs
        assert [leg.grip for leg in legs] == [None, True, None, False, *behind]
        assert legs[1].begin == pytest.approx(0.5, abs=0.005)
        assert legs[-1].begin + legs[-1].duration == pytest.approx(2.0, abs=0.01)
        for leg, after in pairwise(legs):
            assert leg.begin + leg.duration == pytest.approx(after.begin)
    # Two switches after the last sample: nothing lies between them.
    legs = plan(world, recorded([HOME, THERE], 2.0, (2.5, True), (2.6, False))).legs
    assert [leg.grip for leg in legs] == [None, True, False]
    with pytest.raises(WhatIfError, match="fewer than two positions"):
        plan(world, recorded([HOME], 1.0))
    with pytest.raises(WhatIfError, match=r"lasts 0\.003 s: expected more than 0\.004 s"):
        plan(world, recorded([HOME, THERE], 0.003))


def test_a_recorded_way_is_smoothed_over_the_time_that_is_said(world: World) -> None:
    """One odd sample moves its neighbours up to half of that time away, and is itself hardly left.

    What is smooth stays as it is: places, speeds and accelerations.
    """
    rows = [(1e-3 if k == 125 else 0.0, *HOME[1:]) for k in range(251)]
    course = plan(world, recorded(rows, 1.0)).legs[0].course
    moved = course.times[np.abs(course.q[:, 0]) > 1e-12]
    assert moved[[0, -1]] == pytest.approx([0.5 - 0.5 * SMOOTHING_S, 0.5 + 0.5 * SMOOTHING_S])
    assert np.abs(course.q[:, 0]).max() < 1e-4
    times = np.linspace(0.0, 1.0, 251)
    course = plan(world, recorded([(t**3, *HOME[1:]) for t in times.tolist()], 1.0)).legs[0].course
    t = course.times
    for found, smooth in ((course.q, t**3), (course.qdot, 3.0 * t**2), (course.qddot, 6.0 * t)):
        assert found[:, 0] == pytest.approx(smooth, abs=1e-6)
        assert np.all(found[:, 3] == 0.0)


@pytest.mark.parametrize("samples", [3, 4, 5, 30, 31, 32])
def test_a_recording_shorter_than_the_smoothing_is_a_way_all_the_same(
    world: World, samples: int
) -> None:
    """Of an even or an odd number of samples: what it shows of a braking joint stays."""
    seconds = (samples - 0.5) * 1e-3 * world.cell.config.sample_ms
    rows = [(t - t * t, *HOME[1:]) for t in np.linspace(0.0, seconds, 2 * samples).tolist()]
    course = plan(world, recorded(rows, seconds)).legs[0].course
    t = course.times
    assert len(t) == samples
    for found, true in ((course.q, t - t * t), (course.qdot, 1.0 - 2.0 * t), (course.qddot, -2.0)):
        assert found[:, 0] == pytest.approx(true, abs=1e-6)


def test_between_two_switches_at_one_time_goes_one_sample(world: World) -> None:
    """Wherever they are, also before the way begins."""
    sample = world.cell.config.sample_ms * 1e-3
    for when in (-0.1, 0.5):
        legs = plan(world, recorded([HOME, THERE], 2.0, (when, True), (when, False))).legs
        assert [leg.grip for leg in legs] == [None, True, None, False, None]
        assert legs[2].duration == pytest.approx(sample)
        assert legs[1].begin == pytest.approx(max(when, sample))


@pytest.mark.parametrize(
    ("up", "turn", "upper_deg", "refused"),
    [
        (1.0, 0.9, 60.0, False),
        (1.0, -0.9, 60.0, True),
        (-1.0, 0.9, 60.0, True),
        (-1.0, -0.9, 60.0, False),
        (1.0, -0.9, 310.0, False),
        (-1.0, 0.9, 310.0, False),
        (1.0, -0.9, 300.0, True),
    ],
)
def test_a_yaw_that_the_robots_own_wrist_cannot_turn_to_is_refused(
    world: World, up: float, turn: float, upper_deg: float, refused: bool
) -> None:
    """A joint 4 from 0 deg on turns the tool to the left, or to the right if it points down.

    It is the last one that the twin does not have, and may go the long way round.
    """
    robot, point = world.cell.robot, ToolTarget(0.51, 0.16, 0.1)
    bent = plan(world, point).legs[0].course.q[-1].tolist()
    wrist = msgspec.structs.replace(
        next(joint for joint in robot.joints if not joint.twin),
        lower_deg=0.0,
        upper_deg=upper_deg,
        screw_axis=(0.0, 0.0, up, 0.0, -0.65 * up, 0.0),
    )
    stiff = msgspec.structs.replace(wrist, name="spindle", upper_deg=0.0)
    other = msgspec.structs.replace(robot, joints=[*robot.twin_joints, stiff, wrist])
    asked = replace(point, yaw=world.cell.kinematics.tool.yaw(bent) + turn)
    found = plan(replace(world, cell=replace(world.cell, robot=other)), asked)
    assert [reason.cause for reason in found.reasons] == [Cause.LIMIT] * refused
    assert bool(found.legs) is not refused


def test_a_robot_that_cannot_turn_its_tool_is_asked_for_no_yaw(world: World) -> None:
    """Neither the twin nor the robot has a joint for it; a point alone it reaches."""
    robot = world.cell.robot
    bare = msgspec.structs.replace(robot, joints=robot.twin_joints)
    there = replace(world, cell=replace(world.cell, robot=bare))
    assert plan(there, ToolTarget(0.51, 0.16, 0.1)).legs
    with pytest.raises(WhatIfError, match="has no joint that turns the tool about the vertical"):
        plan(there, ToolTarget(0.51, 0.16, 0.1, yaw=0.0))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_joint_may_leave_its_range_by_noise_alone(world: World, sign: float) -> None:
    """A ten-thousandth of the range, of places and of speeds."""
    joint = world.cell.robot.twin_joints[0]
    for share, refused in ((sign * (1.0 + 1e-4), 0), (sign * (1.0 + 4e-4), 1)):
        still = plan(world, recorded([(share * joint.upper, *HOME[1:])] * 2, 1.0))
        fast = plan(world, recorded([HOME, (0.2 * share * joint.velocity, *HOME[1:])], 0.2))
        assert len(still.reasons) == len(fast.reasons) == refused


def test_a_motion_is_looked_at_as_often_as_the_settings_say(world: World) -> None:
    """Nothing between two samples is longer, and there are no more of them than that takes."""
    # No whole number of samples.
    point = Setpoints(("joint_1",), (JointMotion((1.0,), (), (), 1.001),))
    sample = world.cell.config.sample_ms * 1e-3
    for motion in (JointTarget(THERE, 100.0), point):
        (leg,) = plan(world, motion).legs
        times = leg.course.times
        assert (leg.begin, leg.duration) == pytest.approx((0.0, times[-1] + world.lag.mean))
        assert np.diff(times).max() <= sample + 1e-12 and len(times) < times[-1] / sample + 2.0
    assert len(plan(world, JointTarget(HOME)).legs[0].course.times) == 2


def test_a_trajectory_is_looked_at_with_its_speeds_and_accelerations(world: World) -> None:
    """Places, speeds and accelerations of the course belong together; other joints stay."""
    points = (JointMotion((0.4,), (0.3,), (0.0,), 1.0), JointMotion((0.9,), (0.0,), (0.0,), 2.5))
    (leg,) = plan(world, Setpoints(("joint_2",), points)).legs
    course, moved = leg.course, [0, 1, 0, 0]
    assert course is not None and (np.any(course.q != HOME, axis=0) == moved).all()
    for rows, slopes in ((course.q, course.qdot), (course.qdot, course.qddot)):
        assert (np.any(slopes, axis=0) == moved).all()
        steps = np.diff(course.times)[:, None] * 0.5 * (slopes[1:] + slopes[:-1])
        assert np.cumsum(steps, axis=0) == pytest.approx(rows[1:] - rows[0], abs=2e-3)


def test_a_move_takes_its_plan_and_the_lag(world: World) -> None:
    """At the default speed if none is said, with the spread of one lag."""
    verdict = judge(world, JointTarget(THERE))
    assert verdict == judge(world, JointTarget(THERE, world.cell.motion.move.default_speed_percent))
    moves = plan(world, JointTarget(THERE)).legs[0].course.times[-1]
    assert verdict.duration_s == pytest.approx(moves + world.lag.mean)
    assert verdict.duration_spread_s == pytest.approx(world.lag.spread)
    assert judge(world, JointTarget(THERE, 1.0)).duration_s > verdict.duration_s


def test_the_end_of_a_curved_way_is_waited_for_with_the_spread_of_one_lag(world: World) -> None:
    """As that of a straight one; the end of what a bag holds is known."""
    points = Setpoints(("joint_1",), (JointMotion((1.0,), (), (), 1.0),))
    assert judge(world, points).duration_spread_s == pytest.approx(world.lag.spread)
    assert judge(world, recorded([HOME, THERE], 2.0)).duration_spread_s == 0.0


def test_a_programs_time_spreads_with_its_rests_at_fine(world: World) -> None:
    """Each by itself; the lag is not in that time, and a rounded corner has no rest."""
    known = msgspec.structs.replace(world.cell.config.program, fine_spread_ms=30.0)
    config = msgspec.structs.replace(world.cell.config, program=known)
    there = replace(world, cell=replace(world.cell, config=config), lag=Lag(0.02, 7.0))
    lines = moves((THERE, HOME, THERE), world)
    rounded = [msgspec.structs.replace(lines[0], fine=False, cnt=50.0), *lines[1:]]
    for program, rests in ((lines, 3), (rounded, 2)):
        verdict = judge(there, ProgramSteps("A", tuple(program)))
        assert verdict.duration_spread_s == pytest.approx(0.03 * math.sqrt(rests))


def test_a_switch_of_the_suction_takes_the_grippers_time_and_none_where_nothing_is_gripped(
    world: World,
) -> None:
    """To grip, and to let go; a cell may have no parts."""
    motion = ProgramSteps("A", (GripperStep(1, True), GripperStep(2, False)))
    gripper = world.cell.work.gripper
    taken = [1e-3 * gripper.vacuum_ms, 1e-3 * gripper.release_ms]
    bare = replace(world, parts=(), cell=replace(world.cell, work=None))
    for each, seconds in ((world, taken), (bare, [0.0, 0.0])):
        assert [leg.duration for leg in plan(each, motion).legs] == pytest.approx(seconds)


@pytest.mark.parametrize("seconds", [0.0, 0.03, 0.5])
def test_an_answer_is_awaited_only_as_long_as_it_is_missing(world: World, seconds: float) -> None:
    """Behind another wait, that takes its time too: no motion begins before it."""
    switch = GripperStep(1, True, awaited=False)
    lines = (switch, WaitStep(2, seconds), GripperStep(3, True), *moves((THERE,), world, 4))
    planned = plan(world, ProgramSteps("A", lines))
    assert planned.reasons == ()
    assert [leg.grip for leg in planned.legs[:3]] == [True, None, None]
    vacuum = 1e-3 * world.cell.work.gripper.vacuum_ms
    assert planned.legs[3].begin == pytest.approx(max(seconds, vacuum))


def test_a_curved_way_strays_by_a_parabolas_height() -> None:
    """Of the largest acceleration, in the longest step."""
    times, still = np.array([0.0, 0.1, 0.3]), np.zeros((3, 1))
    leg = curved(Course(times, still, still, np.array([[1.0], [-4.0], [2.0]]), times), 0.0, "", 0.5)
    assert leg.way.slack == pytest.approx([4.0 * 0.2**2 / 8.0]) and leg.duration == 0.8


def test_what_braking_gives_back_is_no_work(world: World) -> None:
    """Efforts of 2.25 and 3.25 N m drive at 2 rad/s, -1.75 brake: work and shares by hand."""
    joint = SimpleNamespace(velocity=4.0, acceleration=6.0, effort=6.5)
    model = SimpleNamespace(damping=0.5, friction=0.25, inverse_dynamics=lambda q, v, a: a)
    times, column = np.arange(4.0), np.array([[1.0], [2.0], [-3.0], [-3.0]])
    course = Course(times, 2.0 * times[:, None], np.full((4, 1), 2.0), column, times)
    use = use_of([joint], (), model, course)
    assert use.work == pytest.approx(0.5 * (4.5 + 6.5) + 0.5 * 6.5)
    assert (use.speed, use.acceleration, use.effort, use.effort_at) == (0.5, 0.5, 0.5, 1.0)
    turn = np.array([(0.0,) * 4, (1e-3, 0.0, 0.0, 0.0)])
    course = Course(np.array([0.0, 1e-3]), turn, turn, turn, np.zeros(2))
    use = use_of(world.cell.robot.twin_joints, world.cell.points, world.models[False], course)
    assert use.point_speed == pytest.approx(0.65, rel=0.1), "the stretched arm at 1 rad/s"


def test_a_stroke_of_the_spindle_is_predicted_as_long_as_it_is(world: World) -> None:
    """Upright ways count as any; a motion to where the robot stands is no prediction."""
    down = JointTarget((0.0, 0.0, -0.06, 0.0), 50.0)
    verdict = judge(world, down)
    said = predict(world, down, verdict, "down")
    assert said is not None and said.way_m == pytest.approx(0.1, abs=2e-3)
    assert said.effort == pytest.approx([use.effort_percent / 100.0 for use in verdict.joints])
    assert predict(replace(world, q=down.q), down, verdict, "none") is None


@pytest.mark.parametrize("seconds", [0.0, 0.05, 1.0])
def test_a_wait_takes_its_time_whatever_still_moves(world: World, seconds: float) -> None:
    """Behind CNT100 the robot brakes meanwhile; the next line begins when the wait is over."""
    first, second = moves((THERE, HOME), world)
    steps = (
        msgspec.structs.replace(first, fine=False, cnt=100),
        WaitStep(2, seconds),
        msgspec.structs.replace(second, line=3),
    )
    with_wait, without = (
        plan(world, ProgramSteps("WAITS", chosen)).legs for chosen in (steps, steps[::2])
    )
    begins = [
        next(leg.begin for leg in legs if leg.step.startswith("line 3"))
        for legs in (with_wait, without)
    ]
    assert begins[0] - begins[1] == pytest.approx(seconds)
