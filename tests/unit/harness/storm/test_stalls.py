"""The storm's rule of stalls, on literal histories."""

from __future__ import annotations

import dataclasses

import pytest
from harness.storm.rules.history import Deed, Strike
from harness.storm.rules.literal import STANDS, history, motion, moving, stop
from harness.storm.rules.stalls import replayed

STALL = Strike("halt gateway 0.5", 2.0, 2.5, {"twin": 2.5})
REPLAYED = moving((2.6, 3.6, 30.0))


def asked(sent: float, name: str = "gateway MOVE", **fields: float) -> Deed:
    """Return a request of a client."""
    return dataclasses.replace(motion(sent, **fields), name=name)


def found(*deeds: Deed, moves: list[tuple[object, ...]] = REPLAYED, strike: Strike = STALL) -> int:
    """Return how often the rule is broken where both sides move so."""
    return len(list(replayed(history(moves, moves, deeds=deeds, strikes=[strike]))))


def test_request_that_waited_with_a_stop_and_moves_both_is_found() -> None:
    """Also in the time in which the line to the twin is made again."""
    assert found(asked(2.1), stop(2.3, answered=2.51)) == 2


def test_sides_that_stand_keep_the_rule() -> None:
    """The stop has won."""
    assert found(asked(2.1), stop(2.3, answered=2.51), moves=STANDS) == 0


@pytest.mark.parametrize(
    "deeds",
    [
        [asked(2.1)],
        [asked(2.1), dataclasses.replace(stop(2.3), answered=None)],
        [asked(2.1), stop(2.6)],
        [asked(1.9), stop(2.3)],
        [stop(2.1), asked(2.3)],
        [asked(2.1, "MOVE"), stop(2.3)],
        [asked(2.1), stop(2.3), motion(2.55)],
        [asked(2.1), asked(2.2, "joint move"), stop(2.3)],
        [asked(1.0, "joint move"), asked(2.1), stop(2.3)],
    ],
    ids=[
        "no stop",
        "a stop that nobody acknowledged",
        "a stop behind the stall",
        "asked before the stall",
        "asked after the stop",
        "another way",
        "a new command",
        "another command in the stall",
        "another command before the stall",
    ],
)
def test_motion_that_something_else_explains_keeps_the_rule(deeds: list[Deed]) -> None:
    """Other rules judge it."""
    assert found(*deeds) == 0


def test_command_that_was_refused_explains_nothing() -> None:
    """Neither in the stall nor behind it."""
    for sent in (2.2, 2.55):
        refused = motion(sent, answered=sent + 0.01, success=False)
        assert found(asked(2.1), stop(2.3), refused) == 2, sent


def test_program_that_goes_on_explains_the_twin_and_not_the_robot() -> None:
    """A stopped robot waits for a person."""
    assert found(asked(2.1), stop(2.3), asked(2.55, "jog")) == 1


def test_request_that_waited_elsewhere_or_a_side_that_moved_before_is_not_judged() -> None:
    """Other rules judge what moves then."""
    deeds = [asked(2.1), stop(2.3)]
    assert found(*deeds, strike=dataclasses.replace(STALL, name="halt recorder 0.5")) == 0
    moved = moving((1.0, 3.6, 30.0))
    assert found(*deeds, moves=moved) == 0
