"""A move is judged to its target before it is accepted: an answer of yes is not taken back."""

from __future__ import annotations

import re

import pytest
from harness.pair import SETUP, Pair
from twin_controller.core.actions import MoveTwin
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import Mode

BELOW_TABLE = (0.4, 0.0, -0.045)


@pytest.fixture
def pair() -> Pair:
    """Give a pair that is idle at home."""
    made = Pair()
    made.connect()
    return made


@pytest.mark.parametrize(
    ("target", "elbow", "text"),
    [
        (BELOW_TABLE, "", "below_table"),
        ((0.9, 0.0, 0.0), "", r"0\.9"),
        ((0.3, 0.0, 0.5), "", "joint_3"),
        ((0.4, 0.1, 0.1), "sideways", "elbow = 'sideways' is neither righty nor lefty"),
    ],
)
def test_a_point_that_cannot_be_reached_is_refused_before_anything_moves(
    pair: Pair, target: tuple[float, ...], elbow: str, text: str
) -> None:
    """Until now it was accepted, and stopped 10 ms later."""
    answer = pair.operate("MOVE", target=target, elbow=elbow, speed_percent=20.0)
    assert not answer.success
    assert re.search(text, answer.message), answer.message
    assert pair.state.lead.mode is Mode.IDLE
    assert not any(isinstance(action, MoveTwin) for action in pair.actions)


def test_a_point_that_can_be_reached_is_accepted(pair: Pair) -> None:
    """The twin gets the point as it was given."""
    assert pair.operate("MOVE", target=(0.51, 0.16, 0.10), speed_percent=20.0).success
    (move,) = [action for action in pair.actions if isinstance(action, MoveTwin)]
    assert move.command == "MOVE" and move.target == (0.51, 0.16, 0.10)


def test_what_is_allowed_at_all_does_not_depend_on_a_target(pair: Pair) -> None:
    """The page asks before anybody has typed one."""
    assert refusals(SETUP, pair.state, pair.now)["MOVE"] == ""
