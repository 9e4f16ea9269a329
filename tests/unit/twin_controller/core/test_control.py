"""One seat holds control, the others ask for it; every (state, action) pair."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_ros.names import Seat
from twin_controller.core.control import (
    NOBODY,
    Control,
    Outcome,
    ask,
    deny,
    end_loan,
    expire,
    forgive,
    give,
    heard,
    keep,
    lend,
    others_text,
    refusal,
    release,
    take,
    unasked,
)

KEEP_S, ANSWER_S, NOW = 5.0, 20.0, 110.0
A, B, C = Seat("fitter", "1"), Seat("foreman", "2"), Seat("fitter", "3")
FREE = Control()
HELD = Control(A, since=100.0, seen=109.0)
ASKED = Control(A, since=100.0, seen=109.0, asker=B, asked=105.0, asker_seen=109.0)
STATES = {"free": FREE, "held": HELD, "asked": ASKED}
ACTIONS: dict[str, Callable[[Control, Seat], Outcome]] = {
    "TAKE": lambda control, seat: take(control, seat, False, NOW),
    "ASK": lambda control, seat: ask(control, seat, False, NOW),
    "GIVE": lambda control, seat: give(control, seat, NOW),
    "DENY": deny,
    "RELEASE": lambda control, seat: release(control, seat, NOW),
    "KEEP": lambda control, seat: keep(control, seat, False, NOW),
}


SEATS_BY_LETTER = {"A": A, "B": B, "C": C, ".": NOBODY}


@pytest.mark.parametrize(
    ("state", "seat", "answers"),
    [
        # Accepted or not, who holds control then, who asks for it.
        # TAKE ASK GIVE DENY RELEASE KEEP
        ("free", A, "+A. +A. -.. -.. -.. -.."),
        ("held", A, "+A. +A. -A. -A. +.. +A."),
        ("held", B, "-A. +AB -A. -A. -A. -A."),
        ("asked", A, "+AB +AB +B. +A. +B. +AB"),
        ("asked", B, "-AB +AB -AB -AB +A. +AB"),
        ("asked", C, "-AB -AB -AB -AB -AB -AB"),
    ],
)
def test_every_action_in_every_state(state: str, seat: Seat, answers: str) -> None:
    """Seat C is the person who holds control, at another page: it holds nothing."""
    before = STATES[state]
    for action, (success, *seats) in zip(ACTIONS.values(), answers.split(), strict=True):
        holder, asker = (SEATS_BY_LETTER[letter] for letter in seats)
        outcome = action(before, seat)
        after = outcome.control
        assert (outcome.success, after.holder, after.asker) == (success == "+", holder, asker)
        assert outcome.text
        changed = (holder, asker) != (before.holder, before.asker)
        assert bool(outcome.happened) == changed, "what changes hands is a decision, nothing else"


def test_refused_take_says_who_holds_control_since_when_and_what_to_do() -> None:
    """What happened, why, what next."""
    text = take(HELD, B, False, NOW).text
    assert text == (
        "fitter 1 holds control, for 10 s now: ask for it with twin_controller/control, action ASK"
    )


def test_asking_again_does_not_restart_the_clock() -> None:
    """Nor can impatience push the answer away."""
    assert ask(ASKED, B, False, NOW).control.asked == 105.0


@pytest.mark.parametrize(
    ("control", "now", "holder", "asker"),
    [
        (HELD, 109.0 + KEEP_S, A, NOBODY),
        (HELD, 109.1 + KEEP_S, NOBODY, NOBODY),
        (Control(A, 100.0, 109.0, asker=B, asked=105.0, asker_seen=114.0), 114.1, B, NOBODY),
        (Control(A, 100.0, 109.0, asker=B, asked=105.0, asker_seen=103.0), 109.0, A, NOBODY),
        (Control(A, 100.0, 125.0, asker=B, asked=105.0, asker_seen=125.0), 125.0, A, B),
        (Control(A, 100.0, 125.0, asker=B, asked=105.0, asker_seen=125.0), 125.1, B, NOBODY),
    ],
    ids=["there", "gone", "gone, asked", "asker gone", "may still answer", "no answer"],
)
def test_silence_loses_control_after_its_time_and_not_before(
    control: Control, now: float, holder: Seat, asker: Seat
) -> None:
    """A closed page and a forgotten one block nobody; who asked gets it."""
    lost = expire(control, now, KEEP_S, ANSWER_S)
    after = control if lost is None else lost.control
    assert (after.holder, after.asker) == (holder, asker)
    assert (lost is None) == (after == control)


def test_own_standstill_of_the_controller_is_nobodys_silence() -> None:
    """What was said meanwhile waits in its queue."""
    later = NOW + 60.0
    assert expire(HELD, later, KEEP_S, ANSWER_S) is not None
    assert expire(forgive(HELD, 60.0), later, KEEP_S, ANSWER_S) is None


def test_command_of_the_holder_is_a_sign_of_life_and_that_of_others_is_none() -> None:
    """A program that commands needs no further thread for it."""
    assert heard(HELD, A, NOW).seen == NOW
    assert heard(HELD, B, NOW) == HELD
    assert heard(FREE, NOBODY, NOW) == FREE


@pytest.mark.parametrize(
    ("control", "seat", "why"),
    [
        (FREE, NOBODY, ""),
        (FREE, Seat("fitter"), ""),
        (FREE, A, "take control first"),
        (HELD, A, ""),
        (HELD, B, "fitter 1 holds control"),
        (HELD, C, "fitter 1 holds control"),
        (HELD, NOBODY, "fitter 1 holds control"),
    ],
)
def test_who_may_begin_a_motion(control: Control, seat: Seat, why: str) -> None:
    """The holder; while there is nobody, whoever says no session."""
    text = refusal(control, seat, NOW)
    assert why in text and bool(text) == bool(why)


@pytest.mark.parametrize(
    ("control", "seat", "local", "passes"),
    [
        (HELD, NOBODY, "fitter", True),
        (HELD, NOBODY, "foreman", False),
        (HELD, NOBODY, "", False),
        (HELD, C, "fitter", False),
        (HELD, B, "fitter", False),
        (HELD, Seat("", "gateway 1"), "fitter", False),
    ],
)
def test_own_program_of_the_holder_needs_no_control_of_its_own(
    control: Control, seat: Seat, local: str, passes: bool
) -> None:
    """Only one without a person and a session, and only of the person who holds control."""
    text = refusal(control, seat, NOW, local)
    assert (text == "") == passes and (passes or "fitter 1 holds control" in text)


@pytest.mark.parametrize("local", ["foreman", ""])
def test_twin_is_not_lent_to_who_is_not_the_holders_own(local: str) -> None:
    """The answer says who holds control; nothing changes."""
    outcome = lend(HELD, local, NOW, 2.0)
    assert not outcome.success and outcome.control == HELD and "fitter 1" in outcome.text
    assert unasked(outcome.control)


def test_twin_is_lent_for_a_while_and_to_nobody_who_comes_after() -> None:
    """It ends by time and with the hold; nobody's twin need not be lent."""
    lent = lend(HELD, "fitter", NOW, 2.0).control
    assert not unasked(lent) and lent.holder == A
    assert end_loan(lent, NOW + 2.0) == lent and end_loan(lent, NOW + 2.1) == HELD
    asked = ask(lent, B, False, NOW).control
    assert unasked(give(asked, A, NOW).control) and release(lent, A, NOW).control == FREE
    assert lend(FREE, "", NOW, 2.0).success and lend(FREE, "", NOW, 2.0).control == FREE


def test_motion_of_the_twin_is_the_holders_only_if_they_say_so() -> None:
    """The controller cannot see who called move_to."""
    moves = keep(HELD, A, True, NOW).control
    assert not unasked(FREE) and unasked(HELD) and not unasked(moves)
    assert unasked(keep(moves, A, False, NOW).control)
    handed = give(keep(ASKED, A, True, NOW).control, A, NOW).control
    assert unasked(handed), "the next holder says it anew"


def test_pages_are_told_why_without_a_text_that_changes_each_second() -> None:
    """It is published with each state."""
    assert others_text(HELD) == "fitter 1 holds control: ask for it"
    assert "take control first" in others_text(FREE)


SEATS = st.sampled_from([A, B, C])
STEPS = st.lists(st.tuples(st.sampled_from([*ACTIONS, "wait"]), SEATS, st.booleans()), max_size=40)


@given(STEPS)
def test_there_is_never_a_second_holder(steps: list[tuple[str, Seat, bool]]) -> None:
    """Whatever is asked in whatever order, at most one seat may begin a motion."""
    control, now = FREE, 0.0
    for what, seat, flag in steps:
        now += 4.0
        if what == "wait":
            lost = expire(control, now, KEEP_S, ANSWER_S)
            control = control if lost is None else lost.control
        elif what == "TAKE":
            control = take(control, seat, flag, now).control
        elif what == "ASK":
            control = ask(control, seat, flag, now).control
        elif what == "KEEP":
            control = keep(control, seat, flag, now).control
        elif what == "GIVE":
            control = give(control, seat, now).control
        elif what == "RELEASE":
            control = release(control, seat, now).control
        else:
            control = deny(control, seat).control
        assert sum(refusal(control, each, now) == "" for each in (A, B, C)) <= 1
        assert control.asker == NOBODY or control.holder not in (NOBODY, control.asker)
        if control.holder == NOBODY:
            assert control == FREE, "nothing is left of who has gone"


def test_who_gets_control_next_is_said() -> None:
    """The one who asks for it, or nobody."""
    gone = 1e3
    for control, said in ((HELD, "control is free"), (ASKED, "control goes to foreman 2")):
        control = msgspec.structs.replace(control, asker_seen=gone, asked=gone)
        lost = expire(control, gone, KEEP_S, ANSWER_S)
        assert lost is not None
        assert lost.text == f"fitter 1 gives no sign of life: {said}"
