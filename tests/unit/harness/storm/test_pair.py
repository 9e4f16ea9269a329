"""The storm's rules of the pair, on literal histories."""

from __future__ import annotations

import dataclasses

import pytest
from harness.storm.rules.history import Decided, Deed, Entry, Strike, Told
from harness.storm.rules.literal import history, motion, moving, states
from harness.storm.rules.pair import (
    apart_while_idle,
    dead_node,
    not_idle_again,
    stranger_commands,
    two_leaders,
    without_author,
)

REAL, TWIN, REAL_AGAIN = (
    Decided(2.0, "IDLE", "REAL_MOVED", "REAL_LEADS", "real"),
    Decided(2.5, "IDLE", "TWIN_MOVED", "TWIN_LEADS", "twin"),
    Decided(3.0, "IDLE", "REAL_MOVED", "REAL_LEADS", "real"),
)
MOVES = moving((2.0, 3.0, 30.0))


def test_one_leader_after_the_other_keeps_the_rule() -> None:
    """And so does a third that somebody has asked for."""
    assert not list(two_leaders(history(decisions=[REAL, TWIN])))
    asked = history(decisions=[REAL, TWIN, REAL_AGAIN], deeds=[motion(2.7)])
    assert not list(two_leaders(asked))


def test_sides_that_fight_for_the_lead_are_found() -> None:
    """To and fro within two seconds, and nobody has sent anything but what was refused."""
    refused = motion(2.7, answered=2.71, success=False)
    for deeds in ([], [refused]):
        (found,) = two_leaders(history(decisions=[REAL, TWIN, REAL_AGAIN], deeds=deeds))
        assert "real, twin, real" in found.evidence


def test_mode_that_names_another_leader_is_found() -> None:
    """Exactly one leads."""
    wrong = Decided(2.0, "IDLE", "REAL_MOVED", "REAL_LEADS", "twin")
    assert list(two_leaders(history(decisions=[wrong])))


def test_idle_pair_that_is_together_keeps_the_rule() -> None:
    """Also for the moment before a decision."""
    assert not list(apart_while_idle(history(MOVES, MOVES, states=states("IDLE"))))
    seen = states("IDLE", end=2.2) + states("REAL_LEADS", "real", begin=2.2)
    assert not list(apart_while_idle(history(MOVES, states=seen)))


def test_pair_that_is_apart_while_idle_is_found() -> None:
    """By where both really were."""
    (found,) = apart_while_idle(history(MOVES, states=states("IDLE")))
    assert "tools" in found.evidence and found.begin < 2.2


def test_pair_that_says_stopped_may_be_apart() -> None:
    """Only IDLE promises that it is together."""
    assert not list(apart_while_idle(history(MOVES, states=states("STOPPED"))))


@pytest.mark.parametrize(
    "known",
    [
        {"states": states("IDLE", end=2.2) + states("REAL_LEADS", "real", begin=2.2)},
        {"states": states("STOPPED"), "decisions": [REAL]},
        {"states": states("STOPPED"), "audit": [Entry(1.9, "/operator", "MOVE_JOINTS", True)]},
        {"states": states("OFFLINE")},
        {"states": states("STOPPED"), "strikes": [Strike("line", 1.0, 1.5)]},
    ],
)
def test_motion_with_an_author_or_unseen_keeps_the_rule(known: dict[str, object]) -> None:
    """A leader, a decision, the audit; or nobody could see it."""
    assert not list(without_author(history(MOVES, **known)))


@pytest.mark.parametrize(
    "known",
    [
        {},
        {"audit": [Entry(1.9, "/operator", "MOVE_JOINTS", False)]},
        {"audit": [Entry(1.9, "/operator", "STOP", True)]},
        {"decisions": [Decided(2.1, "STOPPED", "RESET", "STOPPED", "")]},
    ],
)
def test_motion_without_an_author_is_found(known: dict[str, object]) -> None:
    """A refused command and a stop are none."""
    (found,) = without_author(history(MOVES, states=states("STOPPED"), **known))
    assert "in mode STOPPED" in found.evidence


NAMED = Decided(2.05, "STOPPED", "TWIN_MOVED_STOPPED", "STOPPED", "")
AGAIN = moving((2.0, 2.1, 90.0), (4.0, 4.1, 90.0))
"""A stopped twin that moves, and does so again long after it was named."""


def sent(*times: float, name: str = "joint velocity") -> list[Deed]:
    """Return what a program sends."""
    return [dataclasses.replace(motion(at, sides=("twin",)), name=name) for at in times]


def test_program_that_was_named_and_sends_on_is_the_author() -> None:
    """It is named once in a stop, however long it goes on."""
    known = {"states": states("STOPPED"), "decisions": [NAMED]}
    assert not list(without_author(history(twin=AGAIN, deeds=sent(1.99, 2.99, 3.99), **known)))


OTHER = sent(1.99) + sent(2.6, 3.3, 3.99, name="joint position")
RESET_SINCE = Decided(3.0, "STOPPED", "RESET", "STOPPED", "")


@pytest.mark.parametrize(
    ("deeds", "decisions"),
    [
        (sent(1.99), [NAMED]),
        (sent(1.99, 3.99), [NAMED]),
        (OTHER, [NAMED]),
        ([], [NAMED]),
        (sent(2.99, 3.99), [NAMED]),
        (sent(1.99, 2.99, 3.99), [NAMED, Decided(2.5, "STOPPED", "STOP", "STOPPED", "")]),
        (sent(1.99, 2.99, 3.99), [NAMED, Decided(2.5, "STOPPED", "ALIGN", "ALIGNING", "")]),
        (sent(1.99, 2.99, 3.99), [RESET_SINCE]),
    ],
    ids=[
        *("has ended", "had ended in between", "another program", "nobody sends", "had not begun"),
        *("stopped anew", "the stop is over", "never named"),
    ],
)
def test_motion_of_a_stopped_twin_that_no_named_program_sends_is_found(
    deeds: list[Deed], decisions: list[Decided]
) -> None:
    """A name given once does not stand for whatever moves afterwards."""
    known = {"states": states("STOPPED"), "decisions": decisions}
    (*_, found) = without_author(history(twin=AGAIN, deeds=deeds, **known))
    assert found.begin == pytest.approx(4.0)


def test_robot_that_moves_while_a_program_of_the_twins_side_is_named_is_found() -> None:
    """A program that moves a stopped twin is no author of the robot's motion."""
    known = {"states": states("STOPPED"), "decisions": [NAMED]}
    (found,) = without_author(history(AGAIN, deeds=sent(1.99, 2.99, 3.99), **known))
    assert found.evidence.startswith("real")


def test_pair_that_is_not_led_back_is_found() -> None:
    """And one that is, is not."""
    assert not list(not_idle_again(history()))
    (found,) = not_idle_again(history(unrecovered="FAULT after 60 s: heartbeat lost"))
    assert "heartbeat lost" in found.evidence


HELD = [Told(0.05 * k, "IDLE", holder="operator 1") for k in range(200)]


@pytest.mark.parametrize(
    ("name", "success", "told", "found"),
    [
        ("gateway MOVE", True, HELD, 1),
        ("gateway MOVE", False, HELD, 0),
        ("MOVE", True, HELD, 0),
        ("gateway MOVE", True, states("IDLE"), 0),
        ("gateway MOVE", True, HELD[:39] + states("IDLE", begin=1.95), 0),
    ],
    ids=["accepted", "refused", "the holder's own", "nobody holds", "let go"],
)
def test_stranger_that_commands_beside_the_holder_is_found(
    name: str, success: bool, told: list[Told], found: int
) -> None:
    """While one person held control from before it until its answer."""
    deed = dataclasses.replace(motion(2.0, answered=2.1, success=success), name=name)
    assert len(list(stranger_commands(history(states=told, deeds=[deed])))) == found


def test_node_that_has_died_is_found() -> None:
    """One violation for each."""
    assert not list(dead_node(history()))
    assert len(list(dead_node(history(deaths=["gateway ended with -6", "emulator ended"])))) == 2
