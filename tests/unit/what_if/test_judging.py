"""Verdicts: what is free passes, and each kind of harm is refused with its reason."""

from __future__ import annotations

import os
import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from fanuc_emulator.tp.rehearsal import rehearse
from harness.pair import SETUP
from harness.running.thorough import thorough
from harness.yaml_files import CONFIG
from scara_config import KeepOut
from scara_config.payload import load_payloads
from scara_config.profile import CHOICE
from scara_config.programs.files import (
    ProgramSteps,
    checked_listing,
    program_path,
    taught_of,
)
from scara_config.programs.steps import GripperStep, MoveStep, WaitStep
from scara_control.dynamics.effort import load_of
from scara_control.dynamics.planner import Planner
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.keep_out.zones import judge_way
from what_if.cell_files_io import find_program, resting_cell
from what_if.errors import WhatIfError
from what_if.geometry.bodies import Kind
from what_if.geometry.furnishing import furnished
from what_if.judging import judge
from what_if.motions import JointTarget, Motion, Recorded, ToolTarget
from what_if.verdict import Cause, Outcome
from what_if.world import Obstacle, World

from scara_description.urdf import parse_urdf

HOME = (0.0, 0.0, -0.16, 0.0)
POST = (0.108, 0.168, 0.0)
WALL = KeepOut("wall", (400.0, 200.0, -300.0), (420.0, 500.0, 500.0))


def steps(*lines: MoveStep | WaitStep | GripperStep) -> ProgramSteps:
    """Return lines as a program."""
    return ProgramSteps("TEST", lines)


def move(number: int, *q: float) -> MoveStep:
    """Return a move of the program: the twin's joints, joint_4 at 0."""
    return MoveStep(number, (q[0], q[1], q[2], 0.0, q[3]), 40.0, True)


@pytest.mark.parametrize(
    ("name", "placed"),
    [("ARTICLE", 0), ("TWO_POINT", 0), ("PALLETISE", 9), *thorough(("VEHICLE", 9))],
)
def test_the_shipped_programs_are_free(world: World, name: str, placed: int) -> None:
    """What the cell does each day is not refused, and its parts arrive."""
    verdict = judge(world, find_program(world.cell, name, CONFIG))
    assert verdict.outcome is Outcome.OK, verdict.sentence
    assert (len(verdict.placed), verdict.dropped) == (placed, ())
    assert verdict.clearance is not None and verdict.clearance.at_least_mm > 0.0
    assert verdict.energy_j > 0.0 and verdict.tool_speed_mm_s > 0.0


@pytest.mark.parametrize(
    ("motion", "cause", "said"),
    [
        (ToolTarget(0.9, 0.0, 0.1), Cause.REACH, "outside the reach"),
        (JointTarget((0.0, 0.0, -0.3, 0.0)), Cause.LIMIT, "joint_3 = -0.3 m is outside"),
        (ToolTarget(0.51, 0.16, -0.04), Cause.ZONE, "below_table"),
        (ToolTarget(0.65, 0.0, -0.02), Cause.COLLISION, "the nozzle would hit part_"),
        (ToolTarget(0.05, -0.45, -0.045), Cause.COLLISION, "would hit pallet"),
        (Setpoints(("joint_1",), (JointMotion((2.0,), (), (), 0.1),)), Cause.LIMIT, "joint_1 = "),
        (
            Setpoints(("joint_3",), (JointMotion((0.001,), (), (), 5.0),)),
            Cause.LIMIT,
            "mm is outside [-210, 0]",
        ),
        (Setpoints(("joint_9",), (JointMotion((2.0,), (), (), 1.0),)), Cause.LIMIT, "joint_9"),
        (steps(GripperStep(1, True)), Cause.GRIP, "there is nothing to grip"),
    ],
)
def test_harm_is_refused_with_its_reason(
    world: World, motion: Motion, cause: Cause, said: str
) -> None:
    """Each kind, in words that name what is concerned."""
    verdict = judge(world, motion)
    assert verdict.outcome is Outcome.REFUSED
    assert verdict.reasons[0].cause is cause
    assert said in verdict.sentence


@pytest.mark.parametrize(("share", "outcome"), [(0.9, Outcome.OK), (1.1, Outcome.REFUSED)])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_nozzle_presses_a_part_no_further_aside_than_it_grips_one(
    world: World, sign: float, share: float, outcome: Outcome
) -> None:
    """From straight above, no deeper than the bellows give way: beside its middle it hits it."""
    tree, work, part = world.cell.tree, world.cell.work, world.parts[3]
    pose = tree.poses(np.array([world.q]))[0, tree.index[part.link]] @ part.pose
    x, y, z = pose[:3, 3] + (sign * share * work.gripper.offset_mm * 1e-3, 0.0, 0.0)
    above = judge(world, ToolTarget(x, y, z + 0.05)).target
    down = ToolTarget(x, y, z + 0.5 * work.parts.height - 0.5 * work.give)
    assert judge(replace(world, q=above, parts=(part,)), down).outcome is outcome


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"obstacles": (Obstacle("post", "cylinder", (0.001, 0.6), (0.45, 0.3, 0.0)),)}, "post"),
        ({"obstacles": (Obstacle("ball", "sphere", (0.1,), (0.45, 0.3, 0.1)),)}, "ball"),
        ({"people": ((0.5, 0.6, 0.0),)}, "person 1"),
        ({"zones": (WALL,)}, "zone wall"),
    ],
)
def test_what_stands_in_the_way_is_told(
    world: World, changes: dict[str, object], said: str
) -> None:
    """A turn of joint 1 that is free without it."""
    turn = JointTarget((1.4, 0.0, -0.05, 0.0))
    assert judge(world, turn).outcome is Outcome.OK
    verdict = judge(replace(world, **changes), turn)  # type: ignore[arg-type]
    assert verdict.outcome is Outcome.REFUSED
    assert said in verdict.sentence
    first = verdict.reasons[0]
    assert 0.0 < first.time_s < verdict.duration_s and first.place_mm is not None
    assert 100.0 < np.hypot(*first.place_mm[:2]) < 750.0, "between the arm and what it hits [mm]"


def test_a_person_stands_on_the_floor_where_no_file_tells_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On the plate that is 250 mm below this robot's base, beside the table that turns there."""
    monkeypatch.setitem(os.environ, CHOICE, "fanuc_sr3ia")
    with resting_cell(CONFIG) as (world, _):
        turned = tuple(
            1.0 if joint.name == "table_joint" else q
            for joint, q in zip(world.cell.robot.twin_joints, world.q)
        )
        assert judge(world, JointTarget(turned)).outcome is Outcome.OK
        verdict = judge(replace(world, people=((0.299, 0.42, 0.0),)), JointTarget(turned))
        assert verdict.outcome is Outcome.REFUSED
        assert "person 1 would hit table_link" in verdict.sentence
        assert verdict.reasons[0].place_mm is not None and verdict.reasons[0].place_mm[2] < 0.0
        person = next(
            body
            for body in furnished(replace(world, people=((9.0, 0.0, 0.0),)), ()).bodies
            if body.kind is Kind.PERSON
        )
        low, high = person.corners[:, 2].min(), person.corners[:, 2].max()
        assert low < -0.24 and high == pytest.approx(world.cell.config.person_height_mm * 1e-3)


def test_what_may_touch_is_pressed_from_where_a_hit_begins(world: World) -> None:
    """So much further than the files say: what counts as near, and what the library may err by."""
    config, work = world.cell.config, world.cell.work
    assert work is not None
    room = 1e-3 * config.nearer_mm + 1e-5
    press = furnished(world, ()).press
    assert (press.offset, press.give, press.lay) == pytest.approx(
        (1e-3 * work.gripper.offset_mm + room, work.give + room, 1e-3 * config.lay_mm + room),
        abs=1e-9,
    )


@pytest.mark.parametrize("is_in_urdf", [False, True])
def test_a_folded_arm_hits_a_post_with_its_first_link(world: World, is_in_urdf: bool) -> None:
    """Whether a post stands in the URDF or comes later: only its own foot is in nobody's way."""
    q, end = (0.0, -2.5, -0.01, 0.0), JointTarget((1.4, -2.5, -0.01, 0.0))
    assert judge(replace(world, q=q), end).outcome is Outcome.OK
    there = replace(world, q=q, obstacles=(Obstacle("post", "cylinder", (0.01, 0.4), POST),))
    if is_in_urdf:
        text = world.cell.robot.description.read_text(encoding="utf-8")
        shape = '<collision><geometry><cylinder radius="0.01" length="0.4"/></geometry></collision>'
        joint = '<joint name="foot" type="fixed"><parent link="base_link"/><child link="post"/>'
        place = f'<origin xyz="{" ".join(map(str, POST))}"/></joint>'
        more = f'<link name="post">{shape}</link>{joint}{place}</robot>'
        model = parse_urdf(text.replace("</robot>", more), seen=False)
        there = replace(world, q=q, cell=replace(world.cell, description=model))
    verdict = judge(there, end)
    assert verdict.outcome is Outcome.REFUSED
    assert "link_1 would hit post" in verdict.sentence


@pytest.mark.parametrize(
    ("instead", "early"),
    [("!", (("14", 40), ("22", 20))), ("WAIT .03(sec)", (("14", 10),)), ("WAIT .04(sec)", ())],
)
def test_no_motion_begins_before_the_suction_answers(
    world: World, instead: str, early: tuple[tuple[str, int], ...]
) -> None:
    """PALLETISE's first part without its waits: lost at the pick, carried along at the place."""
    text = re.sub(r"WAIT +\.\d+\(sec\)", "!", program_path("PALLETISE", CONFIG).read_text())
    text = re.sub(r"WAIT RI\S+", instead, text).replace("TO 9 ;", "TO 1 ;")
    robot = world.cell.robot
    taught = taught_of(checked_listing(text, robot, "P"), robot, "P")
    verdict = judge(world, steps(*rehearse(taught, robot, {})))
    assert verdict.outcome is (Outcome.REFUSED if early else Outcome.OK), verdict.sentence
    assert [(reason.cause, reason.step, reason.text) for reason in verdict.reasons] == [
        (
            Cause.GRIP,
            f"line {line} of TEST",
            f"begins {ms} ms before the suction answers: add WAIT RI[1]",
        )
        for line, ms in early
    ]


def test_a_way_that_was_free_with_an_empty_hand_is_looked_at_again_with_a_part(
    world: World,
) -> None:
    """Over the pallet's board at a height between the nozzle and the underside of the part.

    The same way twice in one program, once before the grip and once after it.
    """
    lines = list(find_program(world.cell, "PALLETISE", CONFIG).steps)
    grip = next(k for k, s in enumerate(lines) if isinstance(s, GripperStep))
    release = next(k for k in range(grip + 1, len(lines)) if isinstance(lines[k], GripperStep))
    moves = [s for s in lines[grip:release] if isinstance(s, MoveStep)]
    above, low = moves[-2], replace_joint(moves[-1], 2, moves[-1].target[2] - 0.01)
    before = (above, low, above)
    assert judge(world, steps(*before)).outcome is Outcome.OK
    taken = [s for s in lines[:release] if s is not moves[-1]]
    verdict = judge(world, steps(*before, *taken, low))
    assert [reason.text for reason in verdict.reasons] == ["part_1 in hand would hit pallet"]


def test_what_cannot_be_planned_takes_no_time_and_no_energy(world: World) -> None:
    """Nothing moves."""
    verdict = judge(world, ToolTarget(0.9, 0.0, 0.1))
    assert (verdict.duration_s, verdict.duration_spread_s) == (0.0, 0.0)
    assert (verdict.energy_j, verdict.tool_speed_mm_s) == (0.0, 0.0)


def test_a_program_without_a_motion_is_free(world: World) -> None:
    """It sets registers only: no sentence says OK where the outcome is another."""
    verdict = judge(world, steps())
    assert (verdict.outcome, verdict.sentence) == (Outcome.OK, "OK: takes 0.00 s")


def test_reasons_come_in_the_order_of_their_time(world: World) -> None:
    """Whatever order the zones stand in; the sentence tells the first one."""
    far = KeepOut("far", (100.0, 600.0, -300.0), (120.0, 700.0, 500.0))
    for zones in ((WALL, far), (far, WALL)):
        verdict = judge(replace(world, zones=zones), JointTarget((1.8, 0.0, -0.05, 0.0)))
        times = [reason.time_s for reason in verdict.reasons]
        assert times == sorted(times) and len(set(times)) > 1
        assert "wall" in verdict.sentence and "far" in verdict.reasons[-1].text


def replace_joint(step: MoveStep, column: int, value: float) -> MoveStep:
    """Return a move with another position of one joint."""
    target = (*step.target[:column], value, *step.target[column + 1 :])
    return MoveStep(step.line, target, step.speed_percent, step.fine)


def test_a_part_let_go_in_the_air_is_dropped(world: World) -> None:
    """The first part of PALLETISE, let go where the arm is above the pallet."""
    lines = list(find_program(world.cell, "PALLETISE", CONFIG).steps)
    grip = next(k for k, s in enumerate(lines) if isinstance(s, GripperStep))
    lift = next(k for k in range(grip, len(lines)) if isinstance(lines[k], MoveStep))
    verdict = judge(world, steps(*lines[: lift + 1], GripperStep(99, False)))
    assert verdict.outcome is Outcome.REFUSED
    assert verdict.reasons[0].cause is Cause.DROP
    assert verdict.dropped == ("part_1",)
    assert verdict.reasons[0].time_s == pytest.approx(verdict.duration_s), "by its last line"


def test_more_than_the_cap_is_limited_and_judged_at_the_cap(world: World) -> None:
    """The robot gets 80 %; asking for more only says so."""
    slow = judge(world, JointTarget((1.0, 0.5, -0.1, 0.0), 80.0))
    fast = judge(world, JointTarget((1.0, 0.5, -0.1, 0.0), 100.0))
    assert (slow.outcome, fast.outcome) == (Outcome.OK, Outcome.LIMITED)
    assert fast.reasons[0].cause is Cause.SPEED
    assert fast.duration_s == slow.duration_s


def test_a_heavy_payload_slows_the_move(world: World) -> None:
    """The rated payload leaves less than all of the acceleration at 80 %."""
    with resting_cell(CONFIG) as (_, models):
        rated = load_payloads(CONFIG).find(4)
        heavy = replace(world, payload=rated, models=models.told(rated), cap_percent=100.0)
        target = JointTarget((2.0, 1.5, -0.1, 0.0), 80.0)
        light = replace(world, cap_percent=100.0)
        loaded, bare = judge(heavy, target), judge(light, target)
        joints, percent = world.cell.robot.twin_joints, world.cell.motion.move.effort_percent
        planner = Planner(joints)
        planner.load = load_of(models.told(rated)[False], joints, percent)
        share = planner.move(JointMotion.at_rest(world.q), target.q, 80.0).share
    assert loaded.outcome is Outcome.LIMITED
    assert loaded.reasons[0].cause is Cause.EFFORT
    assert f"leaves {100.0 * share:.0f} % of" in loaded.reasons[0].text and 0.0 < share < 1.0
    assert loaded.duration_s > bare.duration_s


@pytest.mark.parametrize(
    ("share", "told"), [(1.01, []), (0.8, ["joint_1 would need 125 % of its effort"])]
)
def test_a_joint_that_would_need_more_than_its_effort_is_named(
    world: World, share: float, told: list[str]
) -> None:
    """With what it would need; just enough is enough."""
    target, robot = JointTarget((1.0, 0.0, -0.16, 0.0), 50.0), world.cell.robot
    need = judge(world, target).joints[0].effort_percent
    weak = msgspec.structs.replace(
        robot.joints[0], effort=robot.joints[0].effort * need / 100.0 * share
    )
    poor = msgspec.structs.replace(robot, joints=[weak, *robot.joints[1:]])
    verdict = judge(replace(world, cell=replace(world.cell, robot=poor)), target)
    assert [each.text for each in verdict.reasons] == told
    for reason in verdict.reasons:
        assert 0.0 < reason.time_s < 0.5 * verdict.duration_s, "while it gathers speed"


def test_a_corner_that_is_too_fast_for_a_joint_is_limited(world: World) -> None:
    """One move brakes gently while the next gathers speed: together more than the joint has."""
    begun = replace(world, q=(-1.0, 0.0, -0.05, 0.0))
    last = msgspec.structs.replace(move(2, 2.3, 0.0, -0.05, 0.0), speed_percent=100.0)
    first = MoveStep(1, (1.0, *last.target[1:]), 100.0, True, acc_percent=50.0)
    assert judge(begun, steps(first, last)).outcome is Outcome.OK
    verdict = judge(begun, steps(msgspec.structs.replace(first, fine=False, cnt=100.0), last))
    most = verdict.joints[0].speed_percent
    assert verdict.outcome is Outcome.LIMITED and most > 110.0
    (reason,) = verdict.reasons
    assert (reason.cause, reason.step) == (Cause.SPEED, "line 2 of TEST")
    assert reason.text == f"joint_1 would be at {most:.0f} % of its speed in the corner"
    assert 0.4 * verdict.duration_s < reason.time_s < 0.8 * verdict.duration_s


@pytest.mark.parametrize("angle", [0.3, 0.6, 0.9, 1.2])
@pytest.mark.parametrize("height", [-0.2, -0.15, -0.05])
def test_what_the_controller_refuses_is_refused_here(
    world: World, angle: float, height: float
) -> None:
    """The zones of twin_controller/judge, and whatever else it does not see."""
    end = (angle, 0.4, height, 0.0)
    way = judge_way(SETUP.points, (WALL,), HOME, end, SETUP.velocity, 5.0)
    verdict = judge(replace(world, zones=(WALL,)), JointTarget(end))
    if way.violation:
        assert verdict.outcome is Outcome.REFUSED
        assert "wall" in verdict.zones


@pytest.mark.parametrize("percent", [0.9, 100.1])
def test_a_speed_out_of_range_is_no_question(world: World, percent: float) -> None:
    """Neither 0, the default, nor from 1 to 100."""
    with pytest.raises(WhatIfError, match=r"speed_percent = .*: is neither 0"):
        judge(world, JointTarget(HOME, percent))


def test_a_yaw_beyond_the_wrist_and_without_one(world: World) -> None:
    """Joint 4 turns far enough for each yaw; the verdict stays that of the point."""
    assert judge(world, ToolTarget(0.51, 0.16, 0.1, yaw=1.0)).outcome is Outcome.OK


def recorded(world: World, end: tuple[float, ...]) -> Recorded:
    """Return what a bag would hold of a move: positions, 100 a second, with the encoder's noise."""
    path = Planner(world.cell.robot.twin_joints).move(JointMotion.at_rest(HOME), end, 50.0)
    times = np.arange(0.0, path.duration + 0.2, 0.01)
    q = np.array([path.at(float(t)).q for t in times])
    q += np.random.default_rng(7).normal(0.0, 2e-6, q.shape)
    names = tuple(joint.name for joint in world.cell.robot.twin_joints)
    points = (JointMotion(tuple(row), (), ()) for row in q.tolist())
    return Recorded(Setpoints.due(names, times.tolist(), points))


def test_a_recorded_way_is_judged_like_the_move_that_it_was(world: World) -> None:
    """Free where the move was free, as fast and as strong; refused where a post stands now."""
    end = (1.2, 0.4, -0.06, 0.0)
    way, move = recorded(world, end), judge(world, JointTarget(end))
    verdict = judge(world, way)
    assert verdict.outcome is Outcome.OK, verdict.sentence
    assert verdict.target == pytest.approx(end, abs=1e-4)
    for seen, planned in zip(verdict.joints, move.joints):
        assert seen.speed_percent == pytest.approx(planned.speed_percent, abs=3.0)
    assert verdict.energy_j == pytest.approx(move.energy_j, rel=0.15)
    post = Obstacle("post", "cylinder", (0.002, 0.6), (0.45, 0.3, 0.0))
    assert "post" in judge(replace(world, obstacles=(post,)), way).sentence


def test_a_motion_to_where_the_robot_stands_has_no_speed(world: World) -> None:
    """Nothing moves, and no point is the fastest."""
    verdict = judge(world, JointTarget(tuple(world.q), 50.0))
    assert (verdict.tool_speed_mm_s, verdict.fastest_point) == (0.0, "")
