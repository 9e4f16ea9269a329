"""Monitored standstill: both stand with the drives on, and whatever moves is a fault."""

from __future__ import annotations

import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.running.thorough import examples
from hypothesis import given, settings
from hypothesis import strategies as st
from twin_controller.core.actions import Command
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode

AWAY = shifted(HOME, 10.0)
CREEP = shifted(HOME, 0.04)
"""More than ``change.hysteresis`` away, in deg; once ``settle.timeout_ms`` is over."""


def standing(seconds: float = 1.0) -> Pair:
    """Return a pair that has been in monitored standstill for so long [s]."""
    pair = Pair()
    pair.connect()
    assert pair.operate("STANDSTILL").success
    pair.run(seconds)
    assert pair.mode is Mode.STANDSTILL and pair.drives
    return pair


def test_what_moves_is_stopped_and_then_watched() -> None:
    """Asked for in a motion: both come to rest first, and that is no fault."""
    pair = Pair()
    pair.connect()
    pair.start_program(ramp(HOME, AWAY, 2.0), run=0.5)
    assert pair.mode is Mode.REAL_LEADS
    pair.do("STANDSTILL", 3.0)
    assert pair.mode is Mode.STANDSTILL
    assert {Command.STOP_REAL, Command.STOP_TWIN} <= set(pair.performed())


@pytest.mark.parametrize(
    ("target", "seconds"), [(AWAY, 1.0), (CREEP, 4.0)], ids=["moves", "creeps"]
)
@pytest.mark.parametrize("side", ["real", "program", "twin"])
def test_a_side_that_moves_is_a_fault_that_stops_both(
    side: str, target: tuple[float, ...], seconds: float
) -> None:
    """By a push or a command past the twin's nodes, by a program at the pendant, by the twin."""
    pair = standing(seconds)
    since = len(pair.performed())
    move = {"real": pair.jog_real, "program": pair.start_program, "twin": pair.move_twin}[side]
    move(ramp(HOME, target, 1.0))
    pair.run(1.0)
    assert pair.mode is Mode.FAULT
    assert {Command.STOP_REAL, Command.STOP_TWIN} <= set(pair.performed()[since:])
    assert not pair.operate("STANDSTILL").success


def test_only_a_reset_ends_it() -> None:
    """No motion, no ALIGN and no STOP; who wants to go on says so twice."""
    pair = standing()
    for command in ("ALIGN", "HOME", "RESUME", "PAUSE"):
        answer = pair.operate(command)
        assert not answer.success and "RESET ends it" in answer.message
    refused = refusals(SETUP, pair.state, pair.now)
    assert "RESET ends it" in refused["JOG"] and "RESET ends it" in refused["RUN"]
    pair.do("STOP", 0.5)
    assert pair.mode is Mode.STANDSTILL
    pair.do("RESET", 0.5)
    assert pair.mode is Mode.STOPPED
    pair.do("ALIGN", 2.0)
    assert pair.mode is Mode.IDLE


def test_its_fault_is_not_reset_while_the_robot_does_not_obey(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """RESET would give HOLD back, and forget the stop that switches the drives off in the end."""
    pair = standing()
    monkeypatch.setattr(pair, "command_real", lambda do: None)
    pair.start_program(ramp(HOME, shifted(HOME, 40.0), 5.0), 0.3)
    assert pair.mode is Mode.FAULT
    reply = pair.operate("RESET")
    assert not reply.success and "moves with its drives on" in reply.message
    pair.until(Mode.ESTOP, 1.0)


@pytest.mark.parametrize(
    ("before", "why"), [("ESTOP", "the emergency stop is latched"), ("", "a link is down")]
)
def test_it_takes_the_place_of_no_stronger_stop(before: str, why: str) -> None:
    """A latched emergency stop, a pair without its links."""
    pair = Pair()
    pair.connect()
    if before:
        pair.do(before, 0.5)
    else:
        pair.link("real", False)
        pair.run(0.2)
    answer = pair.operate("STANDSTILL")
    assert not answer.success and why in answer.message


@settings(max_examples=examples(8, 200))
@given(
    st.lists(
        st.sampled_from(["STOP", "PAUSE", "RESUME", "ALIGN", "HOME", "STANDSTILL"]), max_size=6
    )
)
def test_whatever_else_is_asked_for_moves_nothing(commands: list[str]) -> None:
    """And it stays monitored."""
    pair = standing()
    for command in commands:
        pair.operate(command)
        pair.run(0.1)
    assert pair.mode is Mode.STANDSTILL and (pair.real_q, pair.twin_q) == (HOME, HOME)
    pair.jog_real(ramp(HOME, AWAY, 1.0))
    pair.run(0.5)
    assert pair.mode is Mode.FAULT


@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_link_that_blinks_does_not_end_it(side: str) -> None:
    """Nobody watched meanwhile, and somebody may be beside the robot."""
    pair = standing()
    pair.link(side, False)
    pair.run(0.1)
    pair.link(side, True)
    pair.run(4.0)
    assert pair.mode is Mode.FAULT
    assert not pair.operate("MOVE_JOINTS", target=AWAY).success
