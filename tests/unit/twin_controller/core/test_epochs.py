"""What was asked for before a stop never begins after it, in the step that would begin it."""

from __future__ import annotations

import math

import pytest
from harness.pair import HOME, Pair, idle_pair, shifted
from twin_controller.core.actions import Command, MoveTwin, Send
from twin_controller.core.control import ENDING
from twin_controller.core.lead.modes import Mode

OTHER = shifted(HOME, 10.0, 5.0, 0.0)
LATE_S = 0.6
STANDS_S = 1.0
"""After a stop so long the pair has agreed where it stands."""


def idle() -> Pair:
    """Return an idle pair."""
    pair = idle_pair()
    return pair


@pytest.mark.parametrize("stop", ENDING)
@pytest.mark.parametrize("command", ["MOVE_JOINTS", "HOME", "ALIGN", "RESUME", "RESET"])
def test_a_command_from_before_a_stop_is_refused_after_it(stop: str, command: str) -> None:
    """It was read before and judged for a while; the stop was acknowledged meanwhile."""
    pair = idle_pair()
    asked = pair.now
    pair.run(0.2)
    pair.operate(stop)
    pair.run(LATE_S)
    mode = pair.mode
    answer = pair.operate(command, target=OTHER, asked=asked)
    assert not answer.success
    assert answer.message == f"cancelled by {stop}, before it began"
    assert pair.mode is mode
    assert not pair.made(MoveTwin)


def test_a_move_that_is_asked_for_after_the_stop_leaves_it(pair: Pair) -> None:
    """It is a person's act, and the twin is told when it was asked for."""
    pair.operate("STOP")
    pair.run(STANDS_S)
    asked = pair.now
    pair.run(0.1)
    pair.do("MOVE_JOINTS", target=OTHER, asked=asked)
    assert [a.asked for a in pair.actions if isinstance(a, MoveTwin)] == [asked]


@pytest.mark.parametrize("asked", [math.nan, math.inf, 1e9, -5.0, 0.0])
def test_what_another_clock_says_is_not_newer_than_a_stop(asked: float) -> None:
    """It counts as not said: such a command is as old as its arrival."""
    pair = idle_pair()
    pair.operate("STOP")
    pair.run(STANDS_S)
    pair.do("MOVE_JOINTS", target=OTHER, asked=asked)


def test_a_stop_of_a_side_counts_too(pair: Pair) -> None:
    """The twin was stopped by its own side while a move was judged."""
    asked = pair.now
    pair.order_twin(Command.ESTOP_TWIN, 5)
    pair.until(Mode.ESTOP, 1.0)
    answer = pair.operate("RESET", asked=asked)
    assert answer.message == "cancelled by ESTOP (the twin was frozen on its side), before it began"
    assert not any(isinstance(a, Send) and a.command is Command.RESET_REAL for a in pair.actions)


def test_a_lower_speed_is_never_too_late(pair: Pair) -> None:
    """A cap begins no motion."""
    asked = pair.now
    pair.run(0.1)
    pair.operate("STOP")
    pair.do("SPEED", speed_percent=10.0, asked=asked)
