"""The monitor of wear: what a cycle says, what has changed, and whether it finds what wears."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fanuc_emulator.plant.config import load_plant
from fanuc_emulator.plant.wear import Kind, Wear
from harness.imitated_run import BagMaker
from harness.running.thorough import SEARCH
from rosbags.typesys import get_types_from_msg
from scara_config import load_robot
from scipy.stats import t as student
from twin_analysis.health.cycle_reader_io import read_cycle
from twin_analysis.health.dataset_io import RUNS, SHEET, SIGNALS, write_dataset
from twin_analysis.health.health_node import app
from twin_analysis.health.readings import vacuum_s
from twin_analysis.health.signs import CycleSignals, Signs, TorqueError, signs_of
from twin_analysis.health.trend import (
    LEAST,
    STUDENT,
    WINDOW,
    Baseline,
    JointFacts,
    Monitor,
    facts_of,
    words,
)
from twin_analysis.health.trials import WITHIN, RobotRecord, WearScene, judged, run_robot
from twin_analysis.health.virtual_cycles import AMOUNTS, KINDS, STEPS, grown
from typer.testing import CliRunner

FOLDER = Path(__file__).resolve().parents[4] / "config" / "robots" / "fanuc_sr6ia"
DT, LATE = 0.004, 0.1


def swing(inertia: float = 2.0, up: float = 5.0, down: float = 7.0) -> CycleSignals:
    """Return two joints that swing, in closed form: the second is 10 ms later than the first."""
    t = np.arange(0.0, 10.0, DT)

    def q(at: np.ndarray) -> np.ndarray:
        return np.asarray(0.8 * np.sin(2.0 * at))

    v, a = 1.6 * np.cos(2.0 * t), -3.2 * np.sin(2.0 * t)
    torque = inertia * a + np.where(v > 0.0, up, -down) + 0.5 * v
    wanted = np.stack([q(t + LATE), q(t + LATE + 0.01)], axis=1)
    return CycleSignals(t, wanted, np.stack([q(t)] * 2, axis=1), np.stack([torque] * 2, axis=1))


def facts(*names: str) -> JointFacts:
    """Return joints that turn by 1 rad."""
    ones = np.ones(len(names))
    return JointFacts(names, ones, ones, (True,) * len(names), ("deg",) * len(names))


def test_a_cycle_says_friction_by_direction_inertia_and_lag() -> None:
    """As they were put in; friction is that at a quarter of the greatest speed."""
    signs = signs_of(swing(), np.array([2.0, 2.0]))
    assert signs.inertia == pytest.approx([2.0, 2.0], rel=0.01)
    assert signs.forward == pytest.approx([5.25, 5.25], rel=0.02)
    assert signs.backward == pytest.approx([7.25, 7.25], rel=0.02)
    assert signs.lag[0] == pytest.approx(LATE, abs=0.003)
    assert signs.lag[1] - signs.lag[0] == pytest.approx(0.01, abs=1e-4)


def test_what_wears_goes_evenly_from_a_trace_to_all_of_it() -> None:
    """And no further; it stays where and what it is."""
    wear = Wear("friction", 0.8, "joint_2")
    found = [grown(wear, cycles, 4) for cycles in range(6)]
    assert [each.amount for each in found] == pytest.approx([0.2, 0.4, 0.6, 0.8, 0.8, 0.8])
    assert {(each.kind, each.joint) for each in found} == {("friction", "joint_2")}


def test_what_is_drawn_of_wear_is_some_and_bounded() -> None:
    """Less than none would be a robot that gets better."""
    assert all(0.0 < low < high for low, high in AMOUNTS.values())


def test_a_robot_that_tells_no_torque_is_said_to() -> None:
    """Its map has no register for it, or nothing is assigned there and it reads 0."""
    cycle = swing()
    silent = CycleSignals(cycle.times, cycle.wanted, cycle.measured, 0.0 * cycle.torques)
    with pytest.raises(TorqueError, match="no motor torque: its map has no motor_torque"):
        signs_of(silent, np.array([2.0, 2.0]))
    with pytest.raises(TorqueError, match="no joint moves fast enough in both directions"):
        signs_of(cycle, np.array([200.0, 200.0]))


def test_a_joint_that_stands_is_left_out_by_name_and_the_others_are_judged() -> None:
    """Of two joints the second stands; where all do, the error names them."""
    stands = np.array([2.0, 200.0])
    week = [signs_of(swing(up=up), stands) for up in np.linspace(4.9, 5.1, LEAST)]
    base = Baseline(facts("joint_1", "joint_4"), week)
    left_out = "joint_4 moved both ways in 0 of 12 cycles of its first week: left out"
    assert base.left_out.startswith(
        f"{left_out}; joints that moved both ways: 1, and 3 are needed:"
    )
    monitor = Monitor(base)
    found = [monitor.take(signs_of(swing(inertia=3.0), stands)) for _ in range(WINDOW + 1)][-1]
    assert found is not None and found.kind == "payload"
    stood = [replace(each, forward=np.full(2, np.nan)) for each in week]
    with pytest.raises(TorqueError, match=r"no 12 cycles of a joint: joint_1 .*; joint_4 "):
        Baseline(facts("joint_1", "joint_4"), stood)


def test_friction_of_one_direction_is_said_with_its_direction() -> None:
    """The mean of both stays within its limit; the others turn as they did."""
    fastest = np.full(3, 2.0)

    def three(up: float) -> Signs:
        one, worn = swing(), swing(up=up)
        columns = [one.torques[:, 0], one.torques[:, 0], worn.torques[:, 0]]
        wanted, measured = (each[:, [0, 0, 0]] for each in (one.wanted, one.measured))
        return signs_of(CycleSignals(one.times, wanted, measured, np.stack(columns, 1)), fastest)

    monitor = Monitor(Baseline(facts("a", "b", "c"), [three(5.0)] * LEAST))
    found = [monitor.take(three(6.2)) for _ in range(WINDOW + 1)][-1]
    assert found is not None and (found.kind, found.joint) == ("friction", "c")
    assert "more torque against friction in its positive direction than in" in found.text


@pytest.mark.parametrize(
    ("words", "seconds"),
    [
        (["off", "on", "on", "holding part_1", "holding part_1", "off"], 2.0),
        (["off", "on", "holding", "off", "on", "on", "on", "holding", "off"], 2.0),
        (["off", "on", "on", "off"], math.nan),
        (["on", "holding", "on", "holding"], math.nan),
        (["off", "unknown", "on", "holding"], math.nan),
        ([], math.nan),
    ],
)
def test_the_vacuum_is_timed_from_the_switch_to_the_first_hold(
    words: list[str], seconds: float
) -> None:
    """The mean of all; what never held, or sucked before it was looked at, does not count."""
    assert vacuum_s([(float(at), each) for at, each in enumerate(words)]) == pytest.approx(
        seconds, nan_ok=True
    )


def test_a_first_week_needs_enough_cycles() -> None:
    """Else its scatter is not known."""
    assert pytest.approx(student.ppf(0.975, WINDOW - 1), abs=1e-3) == STUDENT
    week = [signs_of(swing(), np.array([2.0, 2.0]))] * (LEAST - 1)
    with pytest.raises(ValueError, match=f"a first week of 11 cycles: needs {LEAST}"):
        Baseline(facts("a", "b"), week)


@pytest.mark.parametrize(
    ("kind", "joint", "change", "text"),
    [
        ("backlash", "joint_3", math.radians(0.5), "joint_3 goes 0.50 deg (0.45 to 0.55) without"),
        ("friction", "joint_2", 0.18, "joint_2 needs 18 % (16 to 20) more torque"),
        ("friction", "joint_2", 1.0, "joint_2 needs 100 % (90 to 110) more torque"),
        ("payload", "", -0.18, "the arm moves 18 % (16 to 20) less inertia"),
        ("stiffness", "joint_1", 0.002, "joint_1 is 2.0 ms (1.8 to 2.2) later"),
        ("vacuum", "", 0.4, "the vacuum takes 40 % (36 to 44) longer"),
    ],
)
def test_a_finding_says_what_how_much_why_and_where_to_look(
    kind: str, joint: str, change: float, text: str
) -> None:
    """In words for whoever has the spanner; known to a tenth, it is between two bounds."""
    said = words(kind, joint, change, 0.1 * abs(change), "deg")
    assert said.startswith(text) and "than in its first week; likely" in said
    assert "look at" in said


@pytest.mark.parametrize(
    ("change", "margin", "text"),
    [
        (0.06, 0.154, "the arm moves 6 % (-9 to 21) more inertia"),
        (-0.06, 0.08, "the arm moves 6 % (-2 to 14) less inertia"),
    ],
)
def test_a_change_that_may_be_none_is_told_with_both_signs(
    change: float, margin: float, text: str
) -> None:
    """An interval over zero says that the change may as well be the other way round."""
    assert words("payload", "", change, margin, "").startswith(text)


def test_play_is_told_in_the_joints_own_unit() -> None:
    """The same name slides in one robot and turns in another."""
    found = []
    for name in ("fanuc_sr6ia", "articulated_six"):
        joints = facts_of(load_robot(FOLDER.parent / name))
        count, third = len(joints.names), joints.names.index("joint_3")
        even = np.ones(count)
        week = Signs(even, even, even, even, 0.0 * even, 0.0 * even, 0.05)
        play = 0.0 * even
        play[third] = 0.01
        monitor = Monitor(Baseline(joints, [week] * LEAST))
        said = [monitor.take(replace(week, play=play)) for _ in range(WINDOW + 1)][-1]
        found.append(said.text.partition(" (")[0] if said else "")
    assert found == ["joint_3 goes 10.00 mm", "joint_3 goes 0.57 deg"]


@pytest.mark.parametrize(
    ("sign", "factor", "said"),
    [
        ("inertia", 0.8, "the arm moves 20 % (20 to 20) less inertia"),
        ("inertia", 1.2, "the arm moves 20 % (20 to 20) more inertia"),
        ("friction", 1.5, "a needs 50 % (50 to 50) more torque against friction than"),
        ("friction", 0.5, ""),
        ("lag", 0.5, ""),
        ("play", 0.5, ""),
    ],
)
def test_a_lighter_tool_is_told_and_less_friction_is_not(
    sign: str, factor: float, said: str
) -> None:
    """A robot that was told of another tool is wrong either way; what goes better has not worn."""
    even, one = np.ones(3), np.array([factor, 1.0, 1.0])
    week = Signs(even, even, even, even, even, even, 0.05)
    changed = {
        "inertia": replace(week, inertia=factor * even),
        "friction": replace(week, forward=one, backward=one),
        "lag": replace(week, lag=one),
        "play": replace(week, play=one),
    }
    monitor = Monitor(Baseline(facts("a", "b", "c"), [week] * LEAST))
    found = [monitor.take(changed[sign]) for _ in range(WINDOW + 1)][-1]
    assert found.text.startswith(said) if said and found else (found, said) == (None, "")


@pytest.mark.parametrize(("factor", "is_found"), [(1.18, False), (1.22, True)])
def test_what_the_first_week_scattered_by_is_no_change(factor: float, is_found: bool) -> None:
    """Its friction went up and down by 10 %: from twice as much on it is looked at."""
    even = np.ones(3)

    def signs(friction: float) -> Signs:
        rubs = np.array([friction, 1.0, 1.0])
        return Signs(rubs, rubs, even, even, even, even, 0.05)

    week = [signs(friction) for friction in (0.9, 1.1) * (LEAST // 2)]
    monitor = Monitor(Baseline(facts("a", "b", "c"), week))
    found = [monitor.take(signs(factor)) for _ in range(WINDOW + 1)][-1]
    assert (found is not None) == is_found


ALONE = [kind for kind in KINDS if kind != "payload"]
CASES: tuple[tuple[Kind, ...], ...] = (
    *((kind,) for kind in (ALONE if SEARCH else ALONE[:1])),
    ("payload", "friction"),
)
"""By day one kind alone; by night each."""


@pytest.fixture(scope="module")
def record() -> RobotRecord:
    """Return what one robot's cycles say: two days for a week, and each case."""
    robot = load_robot(FOLDER)
    plant, random = load_plant(robot, FOLDER, "field:1"), np.random.default_rng(1)
    scene = WearScene(cases=CASES, week=LEAST, within=9)
    return run_robot(robot, plant, random, scene)


def test_what_wears_is_found_on_a_drawn_robot_and_a_healthy_one_is_left_alone(
    record: RobotRecord,
) -> None:
    """Short form of ``./cell bench --health``: alone, and of two at once the worse."""
    trial = judged(record)
    assert trial.false_alarms == ()
    worn = {kind for each in trial.results for kind, _ in each.worn}
    assert worn == set(itertools.chain(*CASES))
    for result in trial.results:
        assert result.right and 0 < result.after <= WITHIN, result


def test_a_false_alarm_counts_as_often_as_it_comes(record: RobotRecord) -> None:
    """While it stays it is one; the same joint again is another one."""
    named = ("friction", "joint_3")
    says = itertools.cycle([named, named, None, None])
    week = replace(record, worn=(), healthy=record.healthy[:8])
    assert judged(week, lambda of: lambda signs: next(says)).false_alarms == (named, named)


@pytest.mark.thorough
def test_two_joints_that_wear_alike_are_two(record: RobotRecord) -> None:
    """The same kind is drawn in another joint; a watch that says nothing has found nothing."""
    robot = load_robot(FOLDER)
    plant, random = load_plant(robot, FOLDER, "field"), np.random.default_rng(1)
    scene = WearScene(steps=STEPS[:3], cases=(("friction",) * 5,), week=LEAST, within=1)
    (wears, _) = run_robot(robot, plant, random, scene).worn[0]
    assert {each.joint for each in wears} == {joint.name for joint in robot.joints}
    silent = judged(record, lambda of: lambda signs: None)
    assert not any(each.right or each.after for each in silent.results)


THREE_RUNS = "a07dad244abd29c44248ecd15c7cbbb62675c0988d97b0aec91c1362717026ee"
"""Of both tables of three runs of seed 1. It changes with the stand-in, with numpy's and pyarrow's
versions, and with nothing else: a machine that shows another one computes otherwise."""


def test_the_same_runs_are_written_anywhere(tmp_path: Path) -> None:
    """Bit for bit, with any number of workers; another seed writes others."""
    assert write_dataset(tmp_path / "a", 3, 1, 1, FOLDER) == THREE_RUNS
    if not SEARCH:
        return
    assert write_dataset(tmp_path / "b", 3, 1, 2, FOLDER) == THREE_RUNS
    for name in (RUNS, SIGNALS, SHEET):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    assert write_dataset(tmp_path / "c", 1, 2, 1, FOLDER) != write_dataset(
        tmp_path / "d", 1, 1, 1, FOLDER
    )


def recorded(
    path: Path,
    friction: float,
    tells: bool = True,
    vacuum: float = 0.2,
    names: Sequence[str] = ("joint_1", "joint_2"),
    silent: tuple[float, float] = (0.0, 0.0),
) -> Path:
    """Write a recording of two joints that swing, the first with so much friction.

    The robot grips once, and has its vacuum after so many seconds. The twin tells nothing between
    two times [s].
    """
    maker, worn, healthy = BagMaker(), swing(2.0, friction, friction), swing(2.0, 5.0, 5.0)
    torques = np.stack([worn.torques[:, 0], healthy.torques[:, 1]], axis=1)
    for k in range(0, len(worn.times), 5):
        header = maker.header(float(worn.times[k]))
        for topic, q, effort in (
            ("real/joint_states", worn.measured[k], torques[k, : 2 * tells]),
            ("twin/joint_states", worn.wanted[k], torques[k, :0]),
        ):
            kind = "sensor_msgs/msg/JointState"
            if topic.startswith("twin") and silent[0] < worn.times[k] < silent[1]:
                continue
            maker.add(worn.times[k], topic, kind, header, list(names), q, 0.0 * q, effort)
    state = "scara_msgs/msg/TwinControllerState"
    maker.store.register(get_types_from_msg("std_msgs/Header header\nstring real_gripper", state))
    for at, word in ((1.0, "off"), (2.0, "on"), (2.0 + vacuum, "holding part_1"), (4.0, "off")):
        maker.add(at, "twin_controller/state", state, maker.header(at), word)
    return maker.write(path)


@pytest.fixture
def read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a recording that stands for many be read once."""
    monkeypatch.setattr("twin_analysis.health.health_node.read_cycle", cache(read_cycle))


@pytest.mark.usefixtures("read_once")
def test_recordings_of_a_cycle_say_what_has_changed(tmp_path: Path) -> None:
    """As from the shell; a robot without torques in its map is said to be one."""
    healthy, worn = recorded(tmp_path / "a.bag", 5.0), recorded(tmp_path / "worn.bag", 10.0)
    week = [str(healthy)] * LEAST
    found = CliRunner().invoke(app, [*week, *[str(worn)] * 7])
    assert found.exit_code == 1 and "worn.bag: joint_1 needs 4" in found.output, found.output
    assert read_cycle(worn, 0.05)[1].vacuum_s == pytest.approx(0.2)
    leaks = recorded(tmp_path / "leaks.bag", 5.0, vacuum=0.3)
    found = CliRunner().invoke(app, [*week, *[str(leaks)] * 7])
    assert found.exit_code == 1 and "leaks.bag: the vacuum takes 50 %" in found.output
    for more, code, text in (
        (6, 3, "6 recordings behind the first week's 12 cannot tell: a change shows from 7 on"),
        (7, 0, "7 recordings are as the first week's 12"),
    ):
        same = CliRunner().invoke(app, [*week, *[str(healthy)] * more])
        assert same.exit_code == code and text in same.output
    other = str(recorded(tmp_path / "other.bag", 5.0, names=("joint_1", "joint_9")))
    found = CliRunner().invoke(app, [other] * LEAST)
    assert isinstance(found.exception, SystemExit) and found.exit_code == 2
    assert "other.bag: has joint_9, which robot.yaml of " in found.output.replace("\n", "")
    mute = recorded(tmp_path / "mute.bag", 5.0, tells=False)
    with pytest.raises(TorqueError, match="told no efforts: its map has no motor_torque"):
        read_cycle(mute, 0.05)


@pytest.mark.usefixtures("read_once")
def test_what_the_twin_did_not_tell_is_left_out_and_said(tmp_path: Path) -> None:
    """It did not stand still meanwhile: its end is left out, and a hole ends the command."""
    ends = recorded(tmp_path / "ends.bag", 5.0, silent=(7.5, 11.0))
    found = CliRunner().invoke(app, [str(ends)] * LEAST)
    assert "ends.bag: 2.5 s are left out, in which the twin told nothing" in found.output
    holed = recorded(tmp_path / "holed.bag", 5.0, silent=(2.0, 4.0))
    found = CliRunner().invoke(app, [str(holed)] * LEAST)
    assert found.exit_code == 3, found.output
    assert "holed.bag: the twin told nothing for 2.0" in found.output.replace("\n", "")
