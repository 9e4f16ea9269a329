"""The echo of the heartbeat: ours however late it comes, and anybody else's."""

from __future__ import annotations

import pytest
from harness.workspace import ROOT
from hypothesis import given
from hypothesis import strategies as st
from scara_config.modbus_map import load_modbus_map
from twin_controller.modbus.heartbeat import (
    MOST,
    Echo,
    heard,
    next_beat,
    reconnected,
    stranger_text,
)

COUNTS = st.integers(1, MOST)


@given(
    begin=st.integers(0, MOST),
    steps=st.lists(
        st.tuples(st.integers(0, 40), st.integers(0, 40), st.booleans()), min_size=1, max_size=60
    ),
)
def test_our_own_beats_are_never_taken_for_somebody_elses(
    begin: int, steps: list[tuple[int, int, bool]]
) -> None:
    """Several on their way, doubled, skipped, over the wrap and over reconnects."""
    written = [begin]
    echo, at = Echo(own=begin, shown=begin), 0
    for writes, shows, again in steps:
        for _ in range(writes):
            written.append(next_beat(written[-1]))
        at = min(at + shows, len(written) - 1)
        if again:
            echo = reconnected(echo)
        echo, stranger = heard(echo, written[at], written[-1])
        assert not stranger, (written[at], written[-1], echo)


@given(own=COUNTS, ahead=st.integers(0, 20), foreign=st.integers(0, MOST))
def test_what_was_never_written_is_somebody_elses(own: int, ahead: int, foreign: int) -> None:
    """A value from before the newest that was shown, one that is still to come, and 0."""
    sent = own
    ours = {own}
    for _ in range(ahead):
        sent = next_beat(sent)
        ours.add(sent)
    _, stranger = heard(Echo(own, own), foreign, sent)
    assert stranger == (foreign not in ours)


@pytest.mark.parametrize(("own", "sent"), [(32766, 1), (32767, 2), (5, 9)])
def test_zero_is_never_ours(own: int, sent: int) -> None:
    """Not even where the count begins again: it disarms the watchdog."""
    assert heard(Echo(own, own), 0, sent) == (Echo(own, 0), True)


def test_the_count_fits_into_a_signed_word() -> None:
    """R[] of one word ends there; 0 would disarm the watchdog."""
    assert next_beat(32766) == 32767 and next_beat(32767) == 1


def test_what_stands_there_before_our_first_beat_is_nobodys() -> None:
    """The last value of a client that has gone; when it changes, somebody is still there."""
    echo, stranger = heard(Echo(), 4711, 3)
    assert not stranger
    echo, stranger = heard(echo, 4711, 5)
    assert not stranger
    assert heard(echo, 4712, 5)[1] and not heard(echo, 2, 5)[1]
    assert heard(echo, MOST, 5)[1] and heard(echo, 0, 5)[1]


def test_a_second_controller_that_counts_alike_is_noticed_too() -> None:
    """Both began at the same instant: the echo goes back as soon as one is a beat ahead."""
    echo, stranger = heard(Echo(7, 7), 9, 9)
    assert not stranger
    assert heard(echo, 8, 9)[1]


@pytest.mark.parametrize(
    ("robot", "name"), [("fanuc_sr6ia", r"R[1]"), ("articulated_six", "register 14 (heartbeat)")]
)
def test_the_text_names_the_register_as_the_robot_calls_it(robot: str, name: str) -> None:
    """And says what to do."""
    layout = load_modbus_map(ROOT / "config" / "robots" / robot)
    text = stranger_text(layout, 4711)
    assert f"somebody else writes {name}: 4711" in text and "one master" in text
