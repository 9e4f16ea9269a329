"""What the doctor moves stands at its end, stays out of keep-out zones, and goes back."""

from __future__ import annotations

import itertools
import math
import shutil
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.emulated.served import CONFIG, LAYOUT, ROBOT, last_beat, served
from harness.processes import wait_until
from harness.wires.proxy import Proxy
from msgspec.structs import replace
from rich.console import Console
from robot_doctor.finding import Finding, Group, Level, note
from robot_doctor.free_space import free_way
from robot_doctor.link_checks import check_nudge
from robot_doctor.profile_files_io import read_profile
from robot_doctor.robot_probe_io import HAIR, SWING, Mover
from scara_config import KeepOut
from scara_control.keep_out.points import watched_points
from twin_controller.config import load_twin_controller
from twin_controller.robot_sample import ControlType, WatchdogState
from typer.testing import CliRunner

from robot_doctor import doctor_node

CONTROLLER = load_twin_controller(ROBOT, CONFIG)
# This machine's own delays are no silence of the robot.
CONTROLLER = replace(CONTROLLER, real=replace(CONTROLLER.real, timeout_ms=1000.0))
HERE = "127.0.0.1"


@pytest.mark.parametrize("aborts", ["true", "false"])
def test_who_moves_a_joint_begins_with_a_set_point_and_sees_the_robot_stand(aborts: str) -> None:
    """CSTOPI alone does not end a program on each controller; HOLD is given back to one at rest."""
    with served(f"ready, cstopi_for_abort: {aborts}") as (port, loop, written):
        with Mover(ROBOT, LAYOUT, CONTROLLER, HERE, port) as mover:
            mover.try_stream()
        assert mover.rests and not loop.snapshot.outputs.progrun
        # What is written last counts from the next tick on.
        wait_until(lambda: "hold" in loop.snapshot.inputs, 2.0, "HOLD, given back")
    assert last_beat(written) == 0, "no alarm at a good end"
    asked = [at for _, _, at, *_ in written]
    first = asked.index(LAYOUT.holding_registers["ring_setpoint"].offset)
    assert first < asked.index(LAYOUT.coils["rsr1"].offset)


def test_a_robot_that_goes_on_after_a_stop_is_told_and_stays_held(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whoever stands there hears it at once."""
    monkeypatch.setattr("robot_doctor.robot_probe_io.REST_S", 0.3)
    monkeypatch.setattr("robot_doctor.robot_probe_io.stands", lambda *_: False)
    # All joints would take half a minute.
    monkeypatch.setattr(Mover, "nudge_all", lambda mover: [note(Group.LINKS, *mover.try_stream())])
    profile = replace(read_profile(CONFIG), robot=ROBOT, layout=LAYOUT)
    with served("ready") as (port, loop, written):
        found = list(doctor_node._robot(profile, LAYOUT, CONTROLLER, (HERE, port), True))
        assert "hold" not in loop.snapshot.inputs
    assert last_beat(written), "its watchdog stays armed, and ends what runs"
    assert "NOT SEEN TO STAND" in found[-1].what and found[-1].level is Level.WRONG, found


@pytest.fixture
def already_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what is only read before anything moves."""
    monkeypatch.setattr(doctor_node, "has_slots", lambda _: False)
    for name in ("ask", "check_answers"):
        monkeypatch.setattr(doctor_node, name, lambda *_: [])


@pytest.mark.usefixtures("already_read")
@pytest.mark.parametrize("back", [True, False])
def test_a_lost_link_ends_what_moves_also_where_it_comes_back(
    back: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing goes on by itself, and a stop is said to be sent only where it was."""
    go, ways = Mover._go, []

    def pull(mover: Mover, *way: Any) -> float:
        ways.append(way)
        line.refuse(True)
        line.refuse(not back)
        return go(mover, *way)

    monkeypatch.setattr(Mover, "_go", pull)
    if not back:
        monkeypatch.setattr("robot_doctor.robot_probe_io.REST_S", 0.3)
    profile = replace(read_profile(CONFIG), robot=ROBOT, layout=LAYOUT)
    with served("ready") as (port, loop, _), Proxy(port) as line:
        address = (HERE, line.port)
        found = list(doctor_node._robot(profile, LAYOUT, CONTROLLER, address, True))
        assert not (back and loop.snapshot.outputs.progrun)
    assert len(ways) == 1
    assert found[0].level is Level.WRONG and "ended: the robot at 127.0.0.1:" in found[0].what
    said = [each.advice for each in found if "NOT SEEN TO STAND" in each.what]
    assert said == ([] if back else ["the stop may not have been sent"])


@pytest.mark.usefixtures("already_read")
@pytest.mark.parametrize("again", [False, True])
def test_who_interrupts_what_moves_hears_all_that_was_found(
    again: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And at once that the robot may not stand; who interrupts its stop too ends the heartbeats."""

    def break_off(mover: Mover) -> Iterator[Finding]:
        mover._start()
        yield note(Group.LINKS, "it moved", "")
        raise KeyboardInterrupt

    def stands(*_: object) -> bool:
        if again:
            raise KeyboardInterrupt
        return False

    monkeypatch.setattr("robot_doctor.robot_probe_io.REST_S", 0.3)
    monkeypatch.setattr("robot_doctor.robot_probe_io.stands", stands)
    monkeypatch.setattr(Mover, "nudge_all", break_off)
    profile = replace(read_profile(CONFIG), robot=ROBOT, layout=LAYOUT)
    with served("ready") as (port, _, _):
        found = list(doctor_node._robot(profile, LAYOUT, CONTROLLER, (HERE, port), True))
    moved, ended, last = [each.what for each in found]
    assert (moved, ended) == ("it moved", "ended: interrupted") and "NOT SEEN TO STAND" in last
    assert "modbus_link" not in [thread.name for thread in threading.enumerate()]


def test_a_finding_is_told_before_the_next_one_is_made(capsys: pytest.CaptureFixture[str]) -> None:
    """Half a minute of motions, and a robot that may be seen to do the wrong thing."""

    def found() -> Iterator[Finding]:
        yield note(Group.LINKS, "joint_1 went away", "")
        assert "joint_1 went away" in capsys.readouterr().out
        yield note(Group.LINKS, "joint_2 did too", "")

    shown = doctor_node.show(Console(), read_profile(CONFIG), found(), CONFIG)
    assert len(shown) == 2 and "2 to look at" in capsys.readouterr().out


def test_a_robot_whose_files_are_wrong_is_neither_moved_nor_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A misspelt keep_out keeps nothing out: it is told before, and nothing is written."""
    config = tmp_path / "config"
    shutil.copytree(CONFIG, config)
    file = config / "robots/fanuc_sr6ia/robot.yaml"
    file.write_text(file.read_text().replace("\nkeep_out:", "\nkeepout:"))
    asked: list[str] = []
    monkeypatch.setattr(doctor_node, "SECONDS", 0.3)
    monkeypatch.setattr(doctor_node, "answer", asked.append)
    monkeypatch.setattr(Mover, "nudge_all", lambda _: [note(Group.LINKS, "it was moved", "")])
    nobody = ["--twin-url", "ws://127.0.0.1:1"]
    with served("ready") as (port, _, written):
        words = ["--host", HERE, "--port", str(port), "--config-dir", str(config)]
        moving = CliRunner().invoke(doctor_node.app, ["--move", *nobody, *words])
        trying = CliRunner().invoke(doctor_node.app, ["--stops", *words])
    assert "WRONG nothing is moved" in moving.output and moving.exit_code == 1
    assert "round trip" in moving.output, "what is only read is told"
    assert trying.exit_code == 2
    for told in (moving.output, trying.output):
        assert "keepout" in told
    assert "it was moved" not in moving.output and asked == written == []


def test_a_stream_that_ends_while_a_joint_is_swung_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else nothing would be wrong, and the joints behind it would only not be seen."""

    def end(mover: Mover, *_: object) -> None:
        loop.post(lambda robot: robot.pulse_input("panel_abort"))
        ended = lambda: mover._sample.control_type is not ControlType.STREAM  # noqa: E731
        wait_until(ended, 2.0, "the end of the stream")

    fine = note(Group.LINKS, "it went where it was sent", "")
    monkeypatch.setattr(Mover, "_nudge", lambda *_: None)
    monkeypatch.setattr("robot_doctor.robot_probe_io.check_nudge", lambda *_: fine)
    monkeypatch.setattr(Mover, "_measure", end)
    with (
        served("ready") as (port, loop, _),
        Mover(ROBOT, LAYOUT, CONTROLLER, HERE, port) as mover,
    ):
        *_, last = mover.nudge_all()
    assert last.level is Level.WRONG and "joint_1: the robot ended the stream" in last.what


def fence(side: float) -> KeepOut:
    """Return a box beside the arm at home, on its left or right [mm]."""
    lower, upper = sorted((side * 300.0, side * 100.0))
    return KeepOut(f"fence{side:+g}", (500.0, lower, -100.0), (800.0, upper, 1000.0))


@pytest.mark.parametrize(
    ("zones", "size", "way"),
    [
        ([], SWING, -10.0),
        ([fence(-1.0)], SWING, 10.0),
        ([fence(1.0)], SWING, -10.0),
        ([fence(-1.0), fence(1.0)], SWING, 0.0),
        ([fence(-1.0), fence(1.0)], HAIR, -0.5),
    ],
)
def test_no_joint_is_moved_into_a_keep_out_zone(
    zones: list[KeepOut], size: dict[str, float], way: float
) -> None:
    """From its nearer limit if that is free, else the other way, else not at all."""
    robot, home = replace(ROBOT, keep_out=zones), tuple(ROBOT.home_positions)
    found, why = free_way(robot, watched_points(robot), home, 0, size)
    assert found == pytest.approx(math.radians(way)) and ("keep-out zone fence" in why) == (not way)
    end = ROBOT.twin_joints[0].upper - 0.01
    assert free_way(replace(robot, keep_out=[]), (), (end, *home[1:]), 0, size)[0] < 0.0


def test_a_joint_that_stays_or_is_not_back_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next --move begins where it stands."""
    seen = itertools.count()
    monkeypatch.setattr(Mover, "_start", lambda _: "")
    monkeypatch.setattr(Mover, "_positions", lambda _: (0.001 * next(seen), *[0.0] * 3))
    monkeypatch.setattr("robot_doctor.robot_probe_io.free_way", lambda *_: (0.0, "a fence"))
    told = [each.what for each in Mover(ROBOT, LAYOUT, CONTROLLER, HERE, 1).nudge_all()]
    assert "joint_1 is not moved: a fence" in told and "joint_1 is not swung: a fence" in told
    assert told[-1] == "joint_1 is not back: it stands +0.52 deg from where it began"


def test_a_slow_joint_gets_the_time_that_a_low_override_leaves_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As doctor --stops leaves it, at 1 %: a good robot would be called wrong."""
    joint = replace(ROBOT.twin_joints[0], velocity_deg_s=60.0)
    robot = replace(ROBOT, keep_out=[], joints=[joint, *ROBOT.joints[1:]])
    now, asked, at = 0.0, (0.0, 0.0), [0.0] * len(robot.joints)

    def sleep(seconds: float) -> None:
        nonlocal now
        now += seconds
        position, percent = asked
        most = 1e-4 * percent * joint.velocity * seconds
        at[0] += min(max(position - at[0], -most), most)

    def tell(_: Mover, positions: Sequence[float], percent: float) -> None:
        nonlocal asked
        asked = positions[0], percent

    clock = SimpleNamespace(monotonic=lambda: now, sleep=sleep)
    sample = SimpleNamespace(override=1, motion=SimpleNamespace(q=at, qdot=()))
    monkeypatch.setattr("robot_doctor.robot_probe_io.time", clock)
    monkeypatch.setattr(Mover, "_start", lambda _: "")
    monkeypatch.setattr(Mover, "_tell", tell)
    monkeypatch.setattr(Mover, "_sample", sample)
    mover = Mover(robot, LAYOUT, CONTROLLER, HERE, 1)
    reason, way = mover.try_stream()
    assert reason == "" and abs(way) == pytest.approx(5.0, abs=0.5)
    # The hair of doctor --move, by a tenth of the speed.
    nudge = mover._nudge(0, joint, HAIR["deg"] * joint.scale)
    assert check_nudge(nudge, robot.twin_joints).level is Level.FINE, nudge


def standing(monkeypatch: pytest.MonkeyPatch, position: float = 0.0) -> tuple[Mover, Any]:
    """Return who moves a robot that only stands, its first joint there, and its sample."""
    now = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: 0.01 * next(now), sleep=lambda _: None)
    sample = SimpleNamespace(
        motion=SimpleNamespace(q=(position, *[0.0] * len(ROBOT.joints)), qdot=()),
        control_type=ControlType.NONE,
        watchdog_state=WatchdogState.DISARMED,
        outputs={"cmdenbl"},
        override=100,
    )
    monkeypatch.setattr("robot_doctor.robot_probe_io.time", clock)
    monkeypatch.setattr(Mover, "_sample", sample)
    mover = Mover(replace(ROBOT, keep_out=[]), LAYOUT, CONTROLLER, HERE, 1)
    mover._came.set()
    return mover, sample


def test_a_robot_a_hair_outside_its_range_gets_no_set_point_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One at its limit may read so; a set point that is outside is refused, and nothing starts."""
    joint = ROBOT.twin_joints[0]
    mover, sample = standing(monkeypatch, joint.upper + 1e-4)
    asked: list[float] = []

    def tell(_: Mover, positions: Sequence[float], percent: float) -> None:
        sample.control_type = ControlType.STREAM
        asked.append(positions[0])

    monkeypatch.setattr(Mover, "_tell", tell)
    mover.try_stream()
    for move in (mover._nudge, mover._measure):
        move(0, joint, -HAIR["deg"] * joint.scale)
    assert max(asked) <= joint.upper


def test_why_a_stream_does_not_start_is_what_was_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a wrong cause would be looked for."""
    mover, _ = standing(monkeypatch)
    refuse = lambda mover, *_: mover._link.rejected("joint_1 is outside")  # noqa: E731
    monkeypatch.setattr(Mover, "_tell", refuse)
    assert mover._start() == "its stream program does not start: joint_1 is outside"


@pytest.mark.thorough
def test_a_joint_swings_back_also_at_a_low_override() -> None:
    """As doctor --stops leaves it: it needs as long for its way back."""
    table = ROBOT.twin_joints[3]
    with served("ready") as (port, loop, _):
        loop.post(lambda robot: robot.write_override(1))
        wait_until(lambda: loop.snapshot.override == 1, 2.0, "a low override")
        with Mover(ROBOT, LAYOUT, CONTROLLER, HERE, port) as mover:
            assert mover._start() == ""
            before = mover._positions()
            mover._measure(3, table, SWING["deg"] * table.scale)
            assert mover._positions() == pytest.approx(before, abs=HAIR["deg"] * table.scale)
