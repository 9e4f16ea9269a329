"""Alarms: one entry when raised, one when cleared, whatever is repeated meanwhile."""

from __future__ import annotations

import pytest
from cell_recorder.journal.alarms import ActiveAlarms
from cell_recorder.journal.entries import Alarm
from hypothesis import given
from hypothesis import strategies as st
from scara_ros.diagnosis import Level

NODE, SOURCE = "/twin_controller", "twin_controller: link real"
OK, WARN, ERROR, STALE = Level.OK, Level.WARN, Level.ERROR, 3


def play(*said: tuple[int, str], hold_s: float = 2.0) -> list[tuple[str, bool, str]]:
    """Let one status be said once a second; return (level, active, text) of all entries."""
    book, told = ActiveAlarms(hold_s, 5.0), []
    for now, (level, text) in enumerate(said):
        told += book.say(float(now), NODE, SOURCE, level, text)
        told += book.look(float(now))
    return [(each.level, each.active, each.text) for each in told]


def test_alarm_is_told_when_raised_and_when_cleared() -> None:
    """Not once for each repeat; a count in it is no news."""
    said = [(WARN, f"{n} lines lost") for n in range(5)]
    assert play((OK, "fine"), *said, *3 * [(OK, "fine")]) == [
        ("warning", True, "0 lines lost"),
        ("warning", False, "0 lines lost"),
    ]


def test_alarm_that_comes_and_goes_is_one() -> None:
    """It is cleared when it has stayed away."""
    assert play(*4 * [(ERROR, "no answer"), (OK, "fine")]) == [("error", True, "no answer")]


def test_alarm_that_says_something_else_or_gets_worse_is_told() -> None:
    """The same number of entries as there are different alarms."""
    said = [(WARN, "late"), (ERROR, "late"), (WARN, "late"), (STALE, "gone"), (ERROR, "gone")]
    assert [each[::2] for each in play(*said)] == [
        ("warning", "late"),
        ("error", "late"),
        ("error", "gone"),
    ]


@pytest.mark.parametrize(
    ("gone", "lasted"), [(14.5, 4.5), (10.0126, 0.013), (10.0, 0.0), (9.5, 0.0)]
)
def test_cleared_alarm_says_how_long_it_lasted(gone: float, lasted: float) -> None:
    """Until it went away, not until that was believed; a clock set back gives no time below 0."""
    book = ActiveAlarms(2.0, 5.0)
    (told,) = book.say(10.0, NODE, SOURCE, ERROR, "no answer")
    assert (told.active, told.seconds, told.raised) == (True, 0.0, 0.0)
    book.say(gone, NODE, SOURCE, OK, "fine")
    assert book.look(gone + 1.5) == [] and book.active == 1
    (cleared,) = book.look(gone + 2.0)
    assert (cleared.seconds, cleared.raised, cleared.time) == (lasted, 10.0, gone + 2.0)
    assert book.active == 0


def test_node_that_falls_silent_is_an_alarm_until_it_speaks() -> None:
    """A node that died tells nobody so itself."""
    book, told = ActiveAlarms(0.0, 5.0), list[Alarm]()
    for now in range(12):
        if now < 3 or now > 9:
            book.heard(float(now), NODE)
        told += book.look(float(now))
    assert [(each.source, each.active, each.time) for each in told] == [
        (NODE, True, 7.0),
        (NODE, False, 10.0),
    ]


def test_clock_that_is_set_back_clears_and_hears_all_the_same() -> None:
    """An hour back must not hold an alarm for an hour."""
    book = ActiveAlarms(2.0, 5.0)
    book.heard(7200.0, NODE)
    book.say(7200.0, NODE, SOURCE, ERROR, "no answer")
    book.say(7201.0, NODE, SOURCE, OK, "fine")
    assert [each.active for each in book.look(3600.0)] == [False]
    told = [each.source for second in range(1, 7) for each in book.look(3600.0 + second)]
    assert told == [NODE]


def test_clock_that_is_set_forward_makes_no_node_silent() -> None:
    """Nor does a machine that slept: nobody was listened to; a dead node is found after that."""
    book = ActiveAlarms(2.0, 5.0)
    book.heard(10.0, NODE)
    assert book.look(10.5) == []
    assert [book.look(3610.0 + second) for second in range(5)] == [[]] * 5
    assert [each.source for each in book.look(3615.0)] == [NODE]


def test_node_that_dies_with_a_warning_of_its_own_name_is_told() -> None:
    """The recorder's status bears its node's name; the death is another alarm than the warning."""
    book = ActiveAlarms(2.0, 5.0)
    for now in range(3):
        book.heard(float(now), NODE)
        book.say(float(now), NODE, NODE, WARN, "messages lost")
        assert book.look(float(now)) == []
    told = [each for now in range(3, 12) for each in book.look(float(now))]
    assert [(each.level, each.source) for each in told] == [("error", NODE)]


@given(st.lists(st.sampled_from([OK, WARN, ERROR]), max_size=40))
def test_raised_and_cleared_take_turns(levels: list[int]) -> None:
    """Whatever is said: never cleared twice, and cleared only what was raised."""
    active = False
    for level, now_active, _ in play(*((level, "same") for level in levels)):
        assert now_active or active
        active = now_active
        assert level in ("warning", "error")
