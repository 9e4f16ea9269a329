"""The real robot's mode switch and override: read, told, and obeyed by whoever would lead it."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from twin_controller.core.actions import Command
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode
from twin_controller.core.orders.stream import unstartable

AWAY = shifted(HOME, 10.0)
ADVICE = "turn it to AUTO there, then RESET"
EITHER = pytest.mark.parametrize("mode", ["T1", "T2"])


def turn(pair: Pair, mode: str) -> None:
    """Turn the switch, at a robot whose drives stay on."""
    pair.operation_mode = mode
    pair.run(0.1)


def told(pair: Pair) -> list[str]:
    """Return what was said of the switch."""
    return [made.why for made in pair.decisions() if made.trigger == "OPERATION_MODE"]


@EITHER
def test_a_robot_that_is_not_in_auto_is_not_led(pair: Pair, mode: str) -> None:
    """Each command that would lead says which mode, and what to do; it follows nothing."""
    turn(pair, mode)
    for command in ("HOME", "MOVE_JOINTS"):
        answer = pair.operate(command, target=AWAY, speed_percent=20.0)
        assert not answer.success
        assert f"mode switch is at {mode}" in answer.message and ADVICE in answer.message
    refused = refusals(SETUP, pair.state, pair.now)
    assert ADVICE in refused["JOG"] and not refused["RUN"] and not refused["STOP"]
    pair.move_twin(ramp(HOME, AWAY, 1.0), run=0.5)
    assert pair.mode is Mode.STOPPED and ADVICE in pair.why
    assert Command.START_STREAM not in pair.performed()


@EITHER
def test_the_twin_follows_a_program_that_a_person_starts_in_t1(pair: Pair, mode: str) -> None:
    """Who stands at the robot leads in every mode."""
    turn(pair, mode)
    pair.start_program(ramp(HOME, AWAY, 1.0), run=0.5)
    assert pair.mode is Mode.REAL_LEADS


@pytest.mark.parametrize(
    ("shown", "why"),
    [
        ({}, ""),
        ({"paused": True}, ""),
        ({"own_program": True}, "runs a program of its own: STOP ends or pauses it"),
        (
            {"own_program": True, "paused": True},
            "has paused a program of its own: end it there, or let it go on",
        ),
        ({"operation_mode": "T2"}, "mode switch is at T2: programs start at its pendant alone"),
    ],
)
def test_a_robot_that_cannot_be_started_says_what_a_person_can_do(
    pair: Pair, shown: dict[str, object], why: str
) -> None:
    """What ends a program that runs is no help with one that is paused."""
    flags = pair.state.sides.real.flags
    assert flags is not None
    told_why = unstartable(SETUP, msgspec.structs.replace(flags, **shown))
    assert why in told_why and bool(told_why) is bool(why)


def test_each_turn_is_told_once(pair: Pair) -> None:
    """A robot that tells nothing, or AUTO from the start, is no news."""
    turn(pair, "AUTO")
    assert told(pair) == []
    turn(pair, "T1")
    turn(pair, "T2")
    turn(pair, "")
    turn(pair, "T2")
    turn(pair, "AUTO")
    assert [why.split(" is at ")[1][:2] for why in told(pair)] == ["T1", "T2", "AU"]
    pair.operate("HOME")
    assert pair.mode is Mode.OPERATOR_LEADS


def test_an_override_that_is_set_at_the_robot_is_told_and_changes_no_lead(pair: Pair) -> None:
    """Once, with both values; while the twin leads, at rest, and after the link was down."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=0.5)
    for percent in (40.0, 40.0, 70.0):
        pair.override = percent
        pair.run(0.2)
        assert pair.mode is Mode.TWIN_LEADS
    pair.link("real", False)
    pair.override = 100.0
    pair.run(0.2)
    pair.link("real", True)
    pair.run(0.5)
    told = [made.why for made in pair.decisions() if made.trigger == "OVERRIDE"]
    assert [why.split("set to ")[1].split(", at")[0] for why in told] == [
        "40 %, it was 100 %",
        "70 %, it was 40 %",
        "100 %, it was 70 %",
    ]


def test_a_turn_while_the_link_was_down_is_told_when_it_is_back(pair: Pair) -> None:
    """Whoever comes back finds another robot than he left."""
    pair.link("real", False)
    pair.operation_mode = "T1"
    pair.run(0.2)
    assert told(pair) == []
    pair.link("real", True)
    pair.run(0.5)
    assert len(told(pair)) == 1


@EITHER
def test_a_robot_that_halts_by_the_turn_ends_the_following(pair: Pair, mode: str) -> None:
    """It switches its drives off: the pair stands in ESTOP, and says by which switch."""
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=0.5)
    assert pair.mode is Mode.TWIN_LEADS
    pair.operation_mode, pair.drives = mode, False
    pair.run(0.1)
    assert pair.mode is Mode.ESTOP and f"mode switch is at {mode}" in pair.why
    assert pair.operate("RESET").success
    pair.run(2.0)
    assert pair.mode is Mode.STOPPED
    assert not pair.operate("HOME").success


@EITHER
def test_a_robot_that_only_pauses_by_the_turn_does_not_go_on(pair: Pair, mode: str) -> None:
    """RESUME says why; in AUTO again it goes on."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=0.5)
    pair.do("PAUSE", run=1.0)
    assert pair.mode is Mode.PAUSED
    turn(pair, mode)
    answer = pair.operate("RESUME")
    assert not answer.success and ADVICE in answer.message and pair.mode is Mode.PAUSED
    turn(pair, "AUTO")
    assert pair.operate("RESUME").success


@EITHER
def test_a_twin_that_goes_on_by_itself_does_not_start_the_robot(pair: Pair, mode: str) -> None:
    """It had paused the pair, and may let it go on in AUTO alone."""
    pair.move_twin(ramp(HOME, AWAY, 3.0), run=0.5)
    pair.order_twin(Command.PAUSE_TWIN, 17)
    pair.run(1.0)
    assert pair.mode is Mode.PAUSED
    turn(pair, mode)
    since = len(pair.performed())
    pair.order_twin(Command.RESUME_TWIN, 17)
    pair.run(0.3)
    assert pair.mode is Mode.STOPPED
    assert not {Command.START_STREAM, Command.CONTINUE_STREAM} & {*pair.performed()[since:]}
