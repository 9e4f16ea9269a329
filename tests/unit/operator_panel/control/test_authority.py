"""One operator holds control, the others ask; viewers watch."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from operator_panel.control.authority import (
    Authority,
    Role,
    answer,
    ask,
    inherited,
    lost,
    passed,
    refusal,
    release,
    returned,
)

FREE = Authority()
HELD = Authority(holder="a")
ASKED = Authority(holder="a", asker="b", asked=10.0)


def test_free_control_is_taken_at_once() -> None:
    """A single operator needs no ceremony."""
    assert ask(FREE, "a", Role.OPERATOR, 0.0) == HELD


def test_held_control_is_asked_for_not_taken() -> None:
    """The holder goes on until it answers."""
    assert ask(HELD, "b", Role.OPERATOR, 10.0) == ASKED


def test_viewer_changes_nothing_by_asking() -> None:
    """Read-only."""
    assert ask(FREE, "v", Role.VIEWER, 0.0) == FREE


def test_third_operator_waits_until_the_question_is_answered() -> None:
    """One question at a time."""
    assert ask(ASKED, "c", Role.OPERATOR, 11.0) == ASKED


def test_asking_again_does_not_restart_the_clock() -> None:
    """Nor can impatience push the answer away."""
    assert ask(ASKED, "b", Role.OPERATOR, 19.0).asked == 10.0


@pytest.mark.parametrize(
    ("page", "granted", "after"),
    [("a", True, Authority(holder="b")), ("a", False, HELD), ("c", True, ASKED)],
)
def test_only_the_holder_answers(page: str, granted: bool, after: Authority) -> None:
    """Granting hands over, keeping drops the question, a stranger's answer counts for nothing."""
    left = answer(ASKED, page, granted)
    assert (left.holder, left.asker) == (after.holder, after.asker)


def test_no_answer_hands_over_after_its_time_and_not_before() -> None:
    """A forgotten page blocks nobody."""
    assert passed(ASKED, 29.9, 20.0, 5.0) == ASKED
    assert passed(ASKED, 30.1, 20.0, 5.0).holder == "b"


def test_lost_page_keeps_control_for_a_while_and_then_frees_it() -> None:
    """A short loss of the network is no change of hands."""
    gone = lost(HELD, "a", 100.0)
    assert passed(gone, 104.9, 20.0, 5.0).holder == "a"
    assert passed(gone, 105.1, 20.0, 5.0) == FREE
    assert passed(returned(gone, "a"), 200.0, 20.0, 5.0) == HELD


def test_page_loaded_again_inherits_what_it_held() -> None:
    """Its id changes, its tab does not."""
    assert inherited(lost(HELD, "a", 1.0), "a", "a2") == Authority(holder="a2")


def test_released_control_goes_to_who_asks() -> None:
    """Else it is free."""
    assert release(ASKED, "a").holder == "b"
    assert release(HELD, "a") == FREE
    assert release(ASKED, "b").asker == ""


@pytest.mark.parametrize(
    ("state", "page", "role", "why"),
    [
        (HELD, "a", Role.OPERATOR, ""),
        (HELD, "b", Role.OPERATOR, "another operator is in control"),
        (FREE, "b", Role.OPERATOR, "take control first"),
        (HELD, "v", Role.VIEWER, "only watches"),
    ],
)
def test_who_may_command(state: Authority, page: str, role: Role, why: str) -> None:
    """Only the operator in control; to stop is everybody's and is not asked about."""
    text = refusal(state, page, role)
    assert why in text and bool(text) == bool(why)


PAGES = st.sampled_from(["a", "b", "c"])
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("ask"), PAGES, st.sampled_from(list(Role))),
        st.tuples(st.just("answer"), PAGES, st.booleans()),
        st.tuples(st.just("release"), PAGES, st.none()),
        st.tuples(st.just("lost"), PAGES, st.none()),
        st.tuples(st.just("returned"), PAGES, st.none()),
        st.tuples(st.just("passed"), PAGES, st.none()),
    ),
    max_size=30,
)


@given(STEPS)
def test_a_viewer_never_holds_control_and_nobody_asks_himself(
    steps: list[tuple[str, str, object]],
) -> None:
    """Whatever happens in whatever order; page v is a viewer."""
    state, now = FREE, 0.0
    for what, page, argument in steps:
        now += 3.0
        if what == "ask":
            page = page if argument is Role.OPERATOR else "v"
            state = ask(state, page, argument, now)  # type: ignore[arg-type]
        elif what == "answer":
            state = answer(state, page, bool(argument))
        elif what == "release":
            state = release(state, page)
        elif what == "lost":
            state = lost(state, page, now)
        elif what == "returned":
            state = returned(state, page)
        else:
            state = passed(state, now, 20.0, 5.0)
        assert "v" not in (state.holder, state.asker)
        assert not state.asker or state.asker != state.holder
        assert state.holder or not state.asker
