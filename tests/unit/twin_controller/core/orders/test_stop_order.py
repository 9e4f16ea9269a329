"""When a stop of the real robot has come about, and when it has not: at the edges of its times."""

from __future__ import annotations

import pytest
from harness.pair import HOME, SETUP
from msgspec.structs import replace
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Command
from twin_controller.core.events import RealMeasured
from twin_controller.core.orders.order import tell
from twin_controller.core.orders.stop import (
    StopOrder,
    disobeyed,
    hear_stop,
    may_give_back,
    safety_patience,
    stop_again,
    stop_patience,
    tell_stop,
)

CONFIG = replace(SETUP.config.stop, hold_ms=100.0, retry_ms=200.0, attempts=3)
AT = 50.0
STANDS = StopOrder(tell(None, Command.STOP_REAL, stop_patience(CONFIG), AT), AT, stands=True)
MOVES = replace(STANDS, stands=False)


@pytest.mark.parametrize(
    ("later", "stop", "may"),
    [
        (0.09, STANDS, False),
        (0.11, STANDS, True),
        (9.0, MOVES, False),
        (9.0, replace(STANDS, given_back=AT), False),
    ],
)
def test_hold_is_given_back_once_the_pulse_has_ended_and_the_robot_stands(
    later: float, stop: StopOrder, may: bool
) -> None:
    """Counted from when it was told last; and not twice."""
    assert may_give_back(stop, CONFIG, AT + later) is may


@pytest.mark.parametrize(
    ("later", "change", "found"),
    [
        (0.59, {}, False),
        (0.61, {}, True),
        (0.61, {"stands": True}, False),
        (9.0, {"given_back": AT}, False),
        (9.0, {"order": tell(None, Command.STOP_REAL, safety_patience(CONFIG), AT)}, False),
    ],
)
def test_a_robot_disobeys_when_it_moves_past_the_time_of_all_attempts(
    later: float, change: dict[str, object], found: bool
) -> None:
    """Counted from when it was told first, however often since; some stops are told for ever."""
    stop = replace(MOVES, **change)
    again = replace(stop, order=replace(stop.order, sent=AT + later))
    assert disobeyed(again, CONFIG, AT + later) is found
    assert not disobeyed(None, CONFIG, AT + later)


@pytest.mark.parametrize("reached", [True, False])
def test_a_stop_that_is_told_again_keeps_its_beginning_if_it_was_heard(reached: bool) -> None:
    """What a robot was told while it was away was never written."""
    again = tell_stop(MOVES, Command.STOP_REAL, CONFIG, reached, AT + 0.1)
    assert again.since == (AT if reached else AT + 0.1) and again.order.sent == AT + 0.1
    other = tell_stop(STANDS, Command.HOLD_REAL, CONFIG, reached, AT + 0.1)
    assert (other.since, other.order.wanted) == (AT + 0.1, Command.HOLD_REAL)


@pytest.mark.parametrize(
    ("command", "period"), [(Command.STOP_REAL, 0.2), (Command.END_AT_REST, 0.4)]
)
def test_a_stop_is_sent_again_after_its_time_and_an_end_at_rest_becomes_one(
    command: Command, period: float
) -> None:
    """That has twice the time, for nobody waits for it."""
    stop = tell_stop(None, command, CONFIG, True, AT)
    assert stop_again(stop, CONFIG, AT + period - 0.01) == (stop, [])
    again, sent = stop_again(stop, CONFIG, AT + period + 0.01)
    assert again is not None and again.order.wanted is Command.STOP_REAL
    assert [(each.command, each.reason) for each in sent] == [
        (Command.STOP_REAL, "the real robot does not show it yet")
    ]
    assert again.since == (AT if command is Command.STOP_REAL else AT + period + 0.01)
    assert stop_again(replace(stop, given_back=AT), CONFIG, AT + 9.0)[1] == []


@pytest.mark.parametrize(("part", "over"), [(0.5, False), (1.1, True)])
def test_a_program_that_was_left_paused_is_watched_for_a_moment(part: float, over: bool) -> None:
    """After HOLD is back: one that went on by it would be stopped anew, one that stays is not."""
    config = SETUP.config.stop
    order = tell(None, Command.STOP_REAL, stop_patience(config), 1.0)
    stop = StopOrder(order, 1.0, left=True, given_back=10.0)
    answered = 10.0 + part * config.retry_ms * 1e-3
    event = RealMeasured(
        answered, answered, answered, 0, JointMotion.at_rest(HOME), own_program=True, paused=True
    )
    assert hear_stop(stop, event, True, config) == (None if over else stop)
