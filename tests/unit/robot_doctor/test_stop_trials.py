"""What stopped a robot is written down, and nothing else."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from harness.emulated.served import CONFIG, LAYOUT, ROBOT, served
from robot_doctor.stop_trials import (
    Look,
    Outcome,
    Result,
    Trial,
    allocation,
    judge_stop,
    proposal,
    question,
)
from robot_doctor.stop_trials_io import StopTrials, UnexpectedError
from scara_config import load_robot
from scara_config.stopping import Stopping
from twin_controller.config import load_twin_controller
from twin_controller.robot_sample import ProgramState
from typer.testing import CliRunner

from robot_doctor import doctor_node

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
        (looks(0.1, PAUSED), Outcome.WORKED, "stopped the robot within 0.2 s and 0.40 deg or mm"),
        (looks(0.1, ABORTED), Outcome.WORKED, "aborted"),
        (looks(9.0, RUNNING), Outcome.FAILED, "did not stop the robot within 2 s"),
        (looks(9.0, PAUSED), Outcome.FAILED, "did not stop the robot within 2 s"),
        (looks(0.1, RUNNING), Outcome.FAILED, "it stands, but its program runs on"),
        ([], Outcome.FAILED, "not told"),
    ],
)
def test_what_stops_a_robot_leaves_it_standing_and_its_program_not_running(
    seen: list[Look], outcome: Outcome, said: str
) -> None:
    """Neither alone will do: a program may stand in a WAIT, an arm may coast."""
    result = judge_stop(Trial.CSTOPI, seen, sent=0.0)
    assert result.outcome is outcome and said in result.what


def results(**outcomes: Outcome) -> list[Result]:
    """Return results by the names of trials."""
    return [Result(Trial[name], outcome, "") for name, outcome in outcomes.items()]


WORKED, FAILED, LEFT = Outcome.WORKED, Outcome.FAILED, Outcome.LEFT_OUT


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
    assert found == Stopping(uop=uop, tried=tried)  # type: ignore[arg-type]
    assert not list(found.faults())


def test_the_allocation_is_what_its_outputs_show() -> None:
    """Few of them, all of them, or none beside a HOLD that has no effect."""
    assert allocation(frozenset({"busy", "progrun"}), [], "none") == "full"
    assert allocation(frozenset({"busy", "gripper"}), [], "full") == "simple"
    assert allocation(frozenset(), results(HOLD=FAILED), "full") == "none"
    assert allocation(frozenset(), results(HOLD=WORKED), "simple") == "simple"


def test_a_question_says_what_the_person_does_first() -> None:
    """By what the program does now."""
    assert "Start a program" in question(Trial.HOLD, ABORTED, False)
    assert "by START at the pendant" in question(Trial.CSTOPI, PAUSED, False)
    assert "START lets the program go on" in question(Trial.CSTOPI, PAUSED, True)
    assert "End the program at the pendant" in question(Trial.RSR, PAUSED, True)


@pytest.mark.parametrize(("said", "meant"), [("y", True), ("", False), ("n", False)])
def test_enter_is_no(said: str, meant: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A question is answered by one key."""
    monkeypatch.setattr("builtins.input", lambda _: said)
    assert doctor_node.answer("?") is meant


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
    with served("ready, uop: simple") as (port, loop, _):
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
    assert load_robot(config).stopping == Stopping(
        uop="simple", tried={"hold": HERE, "cstopi": HERE}
    )
    assert done.exit_code == 1


def test_what_is_not_expected_holds_the_robot_for_good() -> None:
    """A glove on the wrong key ends all; HOLD is off and stays off."""

    def wrong_key(text: str) -> bool:
        raise UnexpectedError("'yy' is neither yes nor no")

    controller = load_twin_controller(ROBOT, CONFIG)
    with served("ready") as (port, loop, _):
        with quick(ROBOT, LAYOUT, controller, (HERE, port), wrong_key) as trials:
            (finding,) = trials.run()
        assert "hold" not in loop.snapshot.inputs
    assert "HOLD was taken away and stays away" in finding.what and trials.results == []


def test_a_robot_as_delivered_is_not_tried_but_told_what_is_missing() -> None:
    """Nothing is asked and nothing written."""
    with served("delivered, num_modbus: 8") as (port, _, written):
        command = ["--stops", "--host", HERE, "--port", str(port), "--config-dir", str(CONFIG)]
        done = CliRunner().invoke(doctor_node.app, command)
    assert done.exit_code == 1 and "$SNPX_ASG is as delivered" in done.output and not written
