"""What stopped a robot is written down, and nothing else."""

from __future__ import annotations

import math
import shutil
import statistics
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fanuc_emulator.config import load_emulator
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.reset import FaultReset
from harness.emulated.served import CONFIG, LAYOUT, ROBOT, last_beat, served, stand_in
from harness.processes import free_port, wait_until
from harness.running.thorough import thorough
from harness.wires.proxy import Proxy
from msgspec.structs import replace
from rich.console import Console
from robot_doctor.finding import Level
from robot_doctor.robot_probe_io import Mover
from robot_doctor.set_up_checks import SetUp
from robot_doctor.stop_trials import (
    MEANS,
    Look,
    Result,
    Trial,
    TrialEnd,
    allocation,
    changes,
    judge_stop,
    proposal,
    question,
)
from robot_doctor.stop_trials_io import SLOWEST_PERCENT, StopTrials, UnexpectedError
from scara_config import load_robot
from twin_controller.config import load_twin_controller
from twin_controller.modbus.port_io import LinkLostError
from twin_controller.robot.signals import Step
from twin_controller.robot_sample import AlarmStatus, ProgramState, WatchdogState
from typer.testing import CliRunner

from robot_doctor import doctor_node, stop_trials_io

CONTROLLER = load_twin_controller(ROBOT, CONFIG)
# This machine's own delays are no silence of the robot.
CONTROLLER = replace(CONTROLLER, real=replace(CONTROLLER.real, timeout_ms=1000.0))

HERE, ELSEWHERE = "127.0.0.1", "10.0.0.5"
RUNNING, PAUSED, ABORTED = ProgramState.RUNNING, ProgramState.PAUSED, ProgramState.ABORTED
quick = partial(StopTrials, comes=5.0, stays=0.4)


def looks(until: float, state: ProgramState, speed: float = 4.0) -> list[Look]:
    """Return readings of a joint that moves until a time and stands from then on."""
    times = [0.01 * k for k in range(250)]
    return [Look(at, (speed * min(at, until), 0.0), state) for at in times]


@pytest.mark.parametrize(
    ("seen", "outcome", "said"),
    [
        (looks(0.1, PAUSED), TrialEnd.WORKED, "stopped the robot within 0.2 s and 0.40 deg or mm"),
        (looks(0.1, ABORTED), TrialEnd.WORKED, "aborted"),
        (looks(9.0, RUNNING), TrialEnd.FAILED, "did not stop the robot within 2 s"),
        (looks(9.0, PAUSED), TrialEnd.FAILED, "did not stop the robot within 2 s"),
        (looks(0.1, RUNNING), TrialEnd.FAILED, "it stands, but its program runs on"),
        ([], TrialEnd.FAILED, "not told"),
    ],
)
def test_what_stops_a_robot_leaves_it_standing_and_its_program_not_running(
    seen: list[Look], outcome: TrialEnd, said: str
) -> None:
    """Neither alone will do: a program may stand in a WAIT, an arm may coast."""
    result = judge_stop(Trial.CSTOPI, seen, sent=0.0)
    assert result.outcome is outcome and said in result.what


def results(**outcomes: TrialEnd) -> list[Result]:
    """Return results by the names of trials."""
    return [Result(Trial[name], outcome, "") for name, outcome in outcomes.items()]


WORKED, FAILED, LEFT = TrialEnd.WORKED, TrialEnd.FAILED, TrialEnd.LEFT_OUT


@pytest.mark.parametrize(
    ("address", "uop", "came", "tried"),
    [
        (HERE, "full", results(HOLD=WORKED, CSTOPI=FAILED), {"hold": HERE, "imstp": HERE}),
        (HERE, "full", results(HOLD=LEFT), dict.fromkeys(("hold", "cstopi", "imstp"), HERE)),
        (ELSEWHERE, "full", results(HOLD=WORKED, IMSTP=LEFT), {"hold": ELSEWHERE}),
        (ELSEWHERE, "none", results(HOLD=FAILED), {}),
        (HERE, "simple", results(CSTOPI=WORKED), {"hold": HERE, "cstopi": HERE}),
    ],
)
def test_a_profile_names_what_stopped_this_robot(
    address: str, uop: str, came: list[Result], tried: dict[str, str]
) -> None:
    """What was tried at another address is forgotten: another address is another robot."""
    found = proposal(ROBOT.stopping, address, came, uop)
    # Nor is it known how late the other robot brakes.
    delay = 480.0 if address == ELSEWHERE and tried else ROBOT.stopping.braking_delay_ms
    assert found == replace(ROBOT.stopping, uop=uop, tried=tried, braking_delay_ms=delay)
    assert not list(found.faults())


def late(lag: float, at: float = 0.3) -> list[Look]:
    """Return readings of a joint that is stopped at a time, behind a filter with a lag [s]."""
    times = [0.01 * k for k in range(200)]
    # A ramp through a first-order lag: its overrun is speed times lag.
    passed = [max(0.0, time - at) for time in times]
    ways = [4.0 * (min(t, at) + lag * (1.0 - math.exp(-p / lag))) for t, p in zip(times, passed)]
    return [Look(t, (0.0, way), PAUSED) for t, way in zip(times, ways)]


@pytest.mark.parametrize("lag", [0.02, 0.05, 0.12])
def test_how_late_a_robot_brakes_is_its_way_by_its_speed(lag: float) -> None:
    """Whatever filter it has; from the newest look on."""
    delay = judge_stop(Trial.HOLD, late(lag), sent=0.3001).delay
    assert delay == pytest.approx(lag, abs=1e-4)


def test_of_a_robot_that_moved_unevenly_nothing_is_measured() -> None:
    """It began to move just before: its speed then says nothing."""
    seen = looks(0.3, PAUSED)
    begun = [Look(look.at, (max(0.0, look.places[0] - 0.8), 0.0), PAUSED) for look in seen]
    result = judge_stop(Trial.HOLD, begun, sent=0.3)
    assert result.outcome is TrialEnd.WORKED and result.delay is None
    assert "how late is not known" in result.what


def test_a_robot_that_brakes_too_late_for_any_zone_did_not_stop() -> None:
    """What robot.yaml allows is named."""
    result = judge_stop(Trial.HOLD, late(0.55), sent=0.3001)
    assert result.outcome is TrialEnd.FAILED and "s late, at most 0.45 s are" in result.what


def test_the_longest_delay_is_proposed_in_whole_steps() -> None:
    """Rounded up; where nothing was measured, or not of all that were, the profile's stays."""
    came = [Result(Trial.HOLD, WORKED, "", 0.0513), Result(Trial.CSTOPI, WORKED, "", 0.0741)]
    assert proposal(ROBOT.stopping, HERE, came, "full").braking_delay_ms == 110.0
    kept = proposal(ROBOT.stopping, HERE, results(HOLD=WORKED), "full")
    assert kept.braking_delay_ms == ROBOT.stopping.braking_delay_ms
    filed = replace(ROBOT.stopping, braking_delay_ms=180.0)
    again = [Result(Trial.HOLD, WORKED, "", 0.03)]
    assert proposal(filed, HERE, again, "full").braking_delay_ms == 180.0
    every = [Result(trial, WORKED, "", 0.03) for trial in MEANS]
    assert proposal(filed, HERE, every, "full").braking_delay_ms == 60.0


def test_a_delay_that_was_not_measured_is_written_as_such() -> None:
    """The longest that a trial lets pass: the stand-in's is none of a real robot."""
    for came, said in ((None, "not measured by"), (0.03, "] 2026-11-28, measured by")):
        found = proposal(ROBOT.stopping, ELSEWHERE, [Result(Trial.HOLD, WORKED, "", came)], "full")
        written = changes(ROBOT.stopping, ELSEWHERE, found, "2026-11-28")
        assert said in written["stopping", "braking_delay_ms"].note


def test_the_allocation_is_what_its_outputs_show() -> None:
    """Few of them, all of them, or none beside a HOLD that has no effect."""
    assert allocation(frozenset({"busy", "progrun"}), [], "none") == "full"
    assert allocation(frozenset({"busy", "gripper"}), [], "full") == "simple"
    assert allocation(frozenset(), results(HOLD=FAILED), "full") == "none"
    assert allocation(frozenset(), results(HOLD=WORKED), "simple") == "simple"


def test_a_question_says_what_the_person_does_first() -> None:
    """By what the program does now."""
    # Most joints are too slow to be seen below it, at 1 % override.
    for word in ("Start a program", "AUTO: by your PLC", "T1: at the pendant", "100%", "1 %"):
        assert word in question(Trial.HOLD, ABORTED, False)
    # In AUTO and Remote no key there starts or resumes one.
    assert "AUTO: by your PLC; T1: at the pendant" in question(Trial.CSTOPI, PAUSED, False)
    assert "START lets the program go on" in question(Trial.CSTOPI, PAUSED, True)
    assert "End the program at the pendant" in question(Trial.RSR, PAUSED, True)


@pytest.mark.parametrize(("said", "meant"), [("y", True), ("", False), ("n", False)])
def test_enter_is_no(said: str, meant: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A question is answered by one key."""
    monkeypatch.setattr("builtins.input", lambda _: said)
    assert stop_trials_io.answer("?") is meant


def person(loop: ServoLoop) -> Callable[[str], bool]:
    """Return somebody at the robot who does what a question wants, and says yes."""

    def agree(text: str) -> bool:
        keys = {"Start a program": "panel_run2", "End the program": "panel_abort"}
        for key in [key for wanted, key in keys.items() if wanted in text]:
            loop.post(lambda robot, key=key: robot.pulse_input(key))
        return True

    return agree


def test_what_was_seen_on_a_robot_is_written_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """*IMSTP and RSR1 are not there with a simple panel; all else works, in this order."""
    config = tmp_path / "config"
    shutil.copytree(CONFIG, config)
    monkeypatch.setattr(doctor_node, "StopTrials", quick)
    with served("ready, uop: simple", strict=True) as (port, loop, _):
        monkeypatch.setattr(doctor_node, "answer", person(loop))
        command = ["--stops", "--host", HERE, "--port", str(port), "--config-dir", str(config)]
        done = CliRunner().invoke(doctor_node.app, command)
        assert loop.snapshot.inputs >= {"hold", "imstp"}
    lines = [line.split() for line in done.output.splitlines()]
    assert [words[:2] for words in lines if words[:1] in (["ok"], ["WRONG"])] == [
        ["ok", "HOLD"],
        ["ok", "START"],
        ["ok", "CSTOPI"],
        ["WRONG", "*IMSTP"],
        ["ok", "the"],
        ["WRONG", "RSR1:"],
    ], done.output
    text = (config / "robots/fanuc_sr6ia/robot.yaml").read_text()
    assert "    hold: 127.0.0.1        # [chk] " in text and "by doctor --stops\n" in text
    stopping = load_robot(config).stopping
    assert stopping.uop == "simple" and stopping.tried == {"hold": HERE, "cstopi": HERE}
    assert "  braking_delay_ms: " in done.output
    assert done.exit_code == 1


@pytest.mark.parametrize(
    ("plant", "filed"), [("ideal", ROBOT.stopping.braking_delay_ms), ("field", 90.0)]
)
def test_how_late_a_stand_in_brakes_is_what_its_profile_says(plant: str, filed: float) -> None:
    """In virtual time, a reading each 10 ms, of all ages when HOLD is sent.

    The field plant's is what test_zones.py takes.
    """
    config = load_emulator(ROBOT, CONFIG, plant, "ready")
    every, sent, robot = round(0.01 / config.dt), round(1.2 / config.dt), stand_in(config)
    robot.write_override(SLOWEST_PERCENT)
    robot.pulse_input("panel_run2")
    seen = list[Look]()
    for tick in range(2 * sent):
        shown = robot.step()
        places = [q / joint.scale for q, joint in zip(shown.positions, ROBOT.joints)]
        state = ProgramState[shown.program_state.name]
        seen.append(Look(tick * config.dt, tuple(places), state))
        if tick == sent:
            robot.write_input("hold", False)
    came = [judge_stop(Trial.HOLD, seen[age::every], seen[sent].at) for age in range(every)]
    assert all(each.delay is not None for each in came), came
    found = [proposal(ROBOT.stopping, HERE, [each], "full").braking_delay_ms for each in came]
    assert statistics.median(found) == filed
    assert filed - 10.0 <= min(found) and max(found) <= filed + 10.0


def test_after_the_emergency_stop_the_next_trial_waits_for_the_drives() -> None:
    """They take 1.5 s on the field plant: START before would be refused."""
    wanted = (Trial.HOLD, Trial.START, Trial.IMSTP, Trial.WATCHDOG)
    with served("ready", plant="field") as (port, loop, _):
        agree = person(loop)
        answer = lambda text: list(Trial)[int(text[0]) - 1] in wanted and agree(text)  # noqa: E731
        with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), answer) as trials:
            list(trials.run())
    told = {each.trial: each for each in trials.results}
    assert told[Trial.IMSTP].outcome is WORKED, told
    assert told[Trial.WATCHDOG].outcome is not LEFT, told


def test_a_robot_whose_alarm_stays_after_reset_is_held_and_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nothing can be tried on it: its drives are off."""
    monkeypatch.setattr(FaultReset, "step", lambda *_: None)
    quickly = replace(CONTROLLER, reset=replace(CONTROLLER.reset, timeout_ms=500.0))
    with served("ready") as (port, loop, _):
        agree = person(loop)
        answer = lambda text: text[0] in "124" and agree(text)  # noqa: E731
        with quick(ROBOT, LAYOUT, quickly, (HERE, port), answer) as trials:
            last = list(trials.run())[-1]
    assert last.level is Level.WRONG and "alarm stays after RESET: SERVO" in last.what


@pytest.mark.parametrize(("outputs", "said"), [({"sysrdy"}, ""), ({"sysrdy", "fault"}, "11-007 x")])
def test_an_alarm_without_a_severity_stops_where_the_robot_shows_a_fault(
    outputs: set[str], said: str
) -> None:
    """Else what a robot has only refused would end all trials, as an alarm that stays."""
    trials = StopTrials(ROBOT, LAYOUT, CONTROLLER, (HERE, 1), lambda _: True)
    motion = SimpleNamespace(q=ROBOT.home_positions)
    sample: Any = SimpleNamespace(
        motion=motion, outputs=outputs, watchdog_state=WatchdogState.DISARMED
    )
    trials._take(sample, 0.0, 0.0)
    program: Any = SimpleNamespace(state=ABORTED)
    trials._told(program, AlarmStatus(11, 7, "", "x", ""))
    assert trials._alarm == said


def test_the_last_look_of_a_wait_is_under_its_lock_as_well() -> None:
    """A reading that comes meanwhile would break off whoever walks through them."""
    trials = StopTrials(ROBOT, LAYOUT, CONTROLLER, (HERE, 1), lambda _: True)
    take = partial(trials._changed.acquire, blocking=False)
    with ThreadPoolExecutor(1) as other:
        assert not trials._wait(0.0, lambda: other.submit(take).result())


def test_what_is_not_expected_holds_the_robot_for_good() -> None:
    """A glove on the wrong key ends all; HOLD is off and stays off."""

    def wrong_key(text: str) -> bool:
        raise UnexpectedError("'yy' is neither yes nor no")

    controller = CONTROLLER
    with served("ready") as (port, loop, _):
        with quick(ROBOT, LAYOUT, controller, (HERE, port), wrong_key) as trials:
            (finding,) = trials.run()
        assert "hold" not in loop.snapshot.inputs
    assert "HOLD was taken away and stays away" in finding.what and trials.results == []


def test_a_robot_whose_hold_is_away_is_asked_nothing() -> None:
    """As trials that ended leave it: no program can be let go on, whoever is asked for it."""
    asked: list[str] = []

    def interrupt(text: str) -> bool:
        asked.append(text)
        raise KeyboardInterrupt

    with served("ready") as (port, _, _):
        for _ in range(2):
            with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), interrupt) as trials:
                (told,) = trials.run()
    assert len(asked) == 1 and "nothing is tried: HOLD is away" in told.what


@pytest.mark.parametrize(
    ("outputs", "watchdog", "said"),
    [
        ({"sysrdy"}, WatchdogState.ARMED, ""),
        ({"sysrdy", "fault"}, WatchdogState.ARMED, "11-007 x"),
        ({"sysrdy"}, WatchdogState.EXPIRED, "heartbeat lost"),
    ],
)
def test_a_robot_with_a_fault_is_asked_nothing(
    outputs: set[str], watchdog: WatchdogState, said: str
) -> None:
    """The fault is the reason, not who did not start a program."""
    trials = StopTrials(ROBOT, LAYOUT, CONTROLLER, (HERE, 1), lambda _: True)
    motion = SimpleNamespace(q=ROBOT.home_positions)
    sample: Any = SimpleNamespace(motion=motion, outputs=outputs, watchdog_state=watchdog)
    trials._take(sample, 0.0, 0.0)
    program: Any = SimpleNamespace(state=ABORTED)
    trials._told(program, AlarmStatus(11, 7, "", "x", ""))
    assert trials._barred().startswith(said) and bool(trials._barred()) is bool(said)


def test_of_a_robot_that_nobody_reaches_nothing_is_said_to_be_held_and_nothing_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Behind a wrong address a y would take what was tried at the right one out of the file."""
    for name in ("PATIENCE_S", "SILENT_S"):
        monkeypatch.setattr(stop_trials_io, name, 0.1)
    asked: list[str] = []
    monkeypatch.setattr(doctor_node, "answer", asked.append)
    with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, free_port()), lambda _: True) as trials:
        (told,) = trials.run()
    assert "no robot at 127.0.0.1:" in told.what and "HOLD may not have been taken" in told.what
    doctor_node._write_stops(Console(soft_wrap=True), ROBOT, CONFIG, ELSEWHERE, trials)
    assert asked == [] and "nothing was tried" in capsys.readouterr().out


def test_a_robot_is_held_whose_link_is_lost_while_a_question_stands_and_comes_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What waits for a link is dropped when it comes."""

    def pull(_: str) -> bool:
        line.refuse(True)
        wait_until(lambda: not trials._link.connected, 2.0, "a lost link")
        send = trials._link.send

        def plug_in(*steps: Step) -> None:
            send(*steps)
            monkeypatch.setattr(trials._link, "send", send)
            line.refuse(False)

        monkeypatch.setattr(trials._link, "send", plug_in)
        raise KeyboardInterrupt

    with served("ready") as (port, loop, _), Proxy(port) as line:
        with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, line.port), pull) as trials:
            (told,) = trials.run()
        assert "hold" not in loop.snapshot.inputs
    assert told.what == "ended: interrupted; HOLD was taken away and stays away"


def test_a_robot_as_delivered_is_not_tried_but_told_what_is_missing() -> None:
    """Nothing is asked and nothing written."""
    with served("delivered, num_modbus: 8") as (port, _, written):
        command = ["--stops", "--host", HERE, "--port", str(port), "--config-dir", str(CONFIG)]
        done = CliRunner().invoke(doctor_node.app, command)
    assert done.exit_code == 1 and "$SNPX_ASG is as delivered" in done.output and not written


def test_a_program_that_is_started_while_the_question_stands_is_slow() -> None:
    """The override is low before anybody is asked to start one."""
    controller, seen = CONTROLLER, []
    with served("ready") as (port, loop, _):

        def ask(text: str) -> bool:
            wait_until(lambda: loop.snapshot.override == 1, 2.0, "a low override")
            seen.append(text)
            return False

        with quick(ROBOT, LAYOUT, controller, (HERE, port), ask) as trials:
            list(trials.run())
    assert "Start a program" in seen[0]


@pytest.mark.parametrize("rests", [*thorough(False), True])
def test_a_stream_program_that_goes_on_after_its_trial_is_held_and_told(
    rests: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is no trial that worked: the doctor's end would take the watchdog from it."""
    monkeypatch.setattr("robot_doctor.robot_probe_io.STOP", ())
    monkeypatch.setattr("robot_doctor.robot_probe_io.GIVE_HOLD_BACK", ())
    monkeypatch.setattr(Mover, "_comes_to_rest", lambda _: rests)
    with served("ready") as (port, loop, _):
        answer = lambda text: text.startswith("6 of 6")  # noqa: E731
        with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), answer) as trials:
            last = list(trials.run())[-1]
        assert not loop.snapshot.outputs.progrun and "hold" not in loop.snapshot.inputs
    assert last.level is Level.WRONG and "is not seen to stand after" in last.what


def test_a_link_that_is_lost_during_the_stream_program_is_the_reason_of_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What was found before is kept."""

    def lose(_: Mover) -> tuple[str, float]:
        raise LinkLostError("the robot at 192.0.2.9:502 did not answer")

    monkeypatch.setattr(Mover, "try_stream", lose)
    with served("ready") as (port, _, _):
        answer = lambda text: text.startswith("6 of 6")  # noqa: E731
        with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), answer) as trials:
            *found, last = trials.run()
    assert len(found) == 5 and "ended: the robot at 192.0.2.9:502 did not" in last.what


def test_a_robot_whose_program_runs_on_is_not_told_to_stand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It may stand in a WAIT: whoever goes in then is there when the WAIT ends."""
    still = lambda seen: bool(seen) and seen[-1].at - seen[0].at >= 0.3  # noqa: E731
    for module in ("stop_trials", "stop_trials_io"):
        monkeypatch.setattr(f"robot_doctor.{module}.stands", still)
    with (
        served("ready, uop: none") as (port, loop, written),
        quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), person(loop)) as trials,
    ):
        (told,) = trials.run()
    assert last_beat(written), "its watchdog stays armed: the doctor's end would leave nothing else"
    assert "it stands, but its program runs on" in told.what
    assert "NOT SEEN TO STAND" in told.advice


@pytest.mark.parametrize("trial", [*thorough(Trial.START), Trial.CSTOPI])
def test_a_program_that_start_let_go_on_without_a_motion_is_paused_again(
    trial: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a WAIT it moves nothing yet; when the doctor ends, so does the watchdog of the robot."""
    runs, asked = StopTrials._runs, [Trial.HOLD]
    stands_still = lambda trials: asked[-1] is not trial and runs(trials)  # noqa: E731
    monkeypatch.setattr(StopTrials, "_runs", stands_still)
    with served("ready") as (port, loop, _):
        agree = person(loop)

        def answer(text: str) -> bool:
            asked.append(list(Trial)[int(text[0]) - 1])
            return asked[-1] in (Trial.HOLD, Trial.START, trial) and agree(text)

        with quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), answer, comes=3.0) as trials:
            list(trials.run())
        assert loop.snapshot.outputs.paused and "hold" in loop.snapshot.inputs
    told = {each.trial: each for each in trials.results}
    assert told[trial].outcome is LEFT and "moved" in told[trial].what


def test_a_robot_that_nothing_was_seen_to_stop_is_not_moved() -> None:
    """Neither by START nor by RSR1, whatever the answer is."""
    untried = replace(ROBOT, stopping=replace(ROBOT.stopping, tried={}))
    with served("ready") as (port, _, written):
        answer = lambda text: text.startswith("6 of 6")  # noqa: E731
        with quick(untried, LAYOUT, CONTROLLER, (HERE, port), answer) as trials:
            list(trials.run())
    assert trials.results[-1].outcome is LEFT and "seen to stop" in trials.results[-1].what
    assert LAYOUT.coils["rsr1"].offset not in [at for _, _, at, *_ in written]


def test_a_program_that_is_too_slow_to_be_seen_is_told_so() -> None:
    """It moves before the person's eyes; what to do is said."""
    with (
        served("ready") as (port, _, _),
        quick(ROBOT, LAYOUT, CONTROLLER, (HERE, port), lambda _: True, comes=0.2) as trials,
    ):
        first = next(trials.run())
    assert "1 deg/s or mm/s or more" in first.what and "more percent" in first.what
    assert "none was started" in first.what


def test_a_server_that_does_not_answer_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As one with another device_id."""

    def silent(*_: object) -> SetUp:
        raise LinkLostError("the robot at 192.0.2.9:502 did not answer in time")

    monkeypatch.setattr(doctor_node, "probe_set_up", silent)
    done = CliRunner().invoke(doctor_node.app, ["--stops", "--config-dir", str(CONFIG)])
    assert done.exit_code == 2 and "192.0.2.9:502 did not answer" in done.output
