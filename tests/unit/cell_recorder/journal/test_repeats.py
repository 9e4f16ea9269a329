"""What flickers leaves some entries, the newest of each span, and how many came."""

from __future__ import annotations

from cell_recorder.journal.entries import Alarm, Audit, Cycle, Decision, Entry, Gap
from cell_recorder.journal.repeats import Repeats
from cell_recorder.journal.story import tell
from hypothesis import given
from hypothesis import strategies as st

from scara_msgs.msg import TwinControllerState

M = TwinControllerState


def alarm(text: str = "no answer for 3 s", active: bool = True, source: str = "real") -> Alarm:
    """Return an alarm."""
    return Alarm(time=1.0, source=source, level="error", active=active, text=text)


def audit(outcome: str) -> Audit:
    """Return an audit, which has no time yet."""
    return Audit(who="ann", what="STOP", success=False, outcome=outcome)


def decision(time: float, before: str, event: str, after: str) -> Decision:
    """Return a decision, by nobody."""
    return Decision(
        time=time,
        seq=1,
        mode_before=before,
        event=event,
        mode_after=after,
        leader="",
        actions=[],
        why="",
        who="",
    )


def test_what_flickers_for_an_hour_is_two_entries_a_minute() -> None:
    """And each minute's last state is kept, so that nothing stays raised which has gone."""
    book, kept = Repeats(20, 60.0), list[Entry]()
    for second in range(3600):
        kept += book.take(float(second), alarm(active=second % 2 == 0))
        kept += book.look(float(second))
    kept += book.close()
    assert len(kept) <= 20 + 2 * 60
    assert isinstance(kept[-1], Alarm) and not kept[-1].active
    assert sum(e.lost if isinstance(e, Gap) else 1 for e in kept) == 3600


def test_what_is_rare_is_kept_as_it_comes() -> None:
    """A person's work is no flicker."""
    book = Repeats(20, 60.0)
    for second in range(0, 3600, 10):
        assert len(book.take(float(second), alarm())) == 1
        assert book.look(float(second)) == []


def test_something_else_is_not_held_back() -> None:
    """One flickering alarm hides no other, and no decision."""
    book = Repeats(2, 60.0)
    for _ in range(9):
        book.take(0.0, alarm())
    other = decision(1.0, "a", "STOP", "b")
    assert book.take(1.0, other) == [other]
    assert book.take(1.0, alarm(source="twin")) == [alarm(source="twin")]
    assert book.take(1.0, alarm()) == []


def test_numbers_make_no_difference_and_a_time_is_put_in() -> None:
    """A refusal with another number is the same refusal, and is told when it came."""
    book = Repeats(1, 60.0)
    assert len(book.take(0.0, audit("3.1 mm too far"))) == 1
    assert book.take(5.0, audit("3.2 mm too far")) == book.take(6.0, audit("4 mm too far")) == []
    gap, last = book.look(60.0)
    assert isinstance(gap, Gap) and (gap.lost, gap.since, gap.until) == (1, 5.0, 6.0)
    assert "the same audit again and again: more than 1 in 60 s" in gap.why
    assert isinstance(last, Audit) and (last.time, last.outcome) == (6.0, "4 mm too far")


def test_commands_with_other_numbers_are_other_commands() -> None:
    """Who moved to which places is kept, however many they are."""
    book = Repeats(1, 60.0)
    moves = [
        Audit(who="ann", what=f"MOVE to {place} mm", success=True, outcome="done")
        for place in range(100)
    ]
    assert [book.take(0.0, move) for move in moves] == [[move] for move in moves]


def test_a_clock_that_is_set_back_ends_a_span() -> None:
    """What is held back does not wait for an hour to come again."""
    book = Repeats(1, 60.0)
    for _ in range(2):
        book.take(7200.0, alarm())
    assert book.look(3600.0) == [alarm()]


def test_each_cycle_is_kept() -> None:
    """They are counted: none is the same as another."""
    cycle = Cycle(
        start=0.0,
        end=1.0,
        program="",
        leader="real",
        who="",
        parts_placed=0,
        parts_dropped=0,
        worst_error_mm=None,
        paused_s=0.0,
        outcome="done",
        why="",
    )
    book = Repeats(1, 60.0)
    assert [book.take(0.0, cycle) for _ in range(5)] == 5 * [[cycle]]


def test_a_stop_behind_decisions_that_are_held_back_is_the_last_word() -> None:
    """Else ``why`` and the farm would say that a stopped pair went on."""
    book, kept = Repeats(2, 60.0), list[Entry]()
    for second in range(10):
        before, after = (M.IDLE, M.TWIN_LEADS) if second % 2 else (M.TWIN_LEADS, M.IDLE)
        kept += book.take(float(second), decision(float(second), before, "MOVES", after))
    kept += book.take(10.0, decision(10.0, M.TWIN_LEADS, "STOP", M.STOPPED))
    kept += [*book.look(61.0), *book.look(75.0), *book.close()]
    times = [entry.time for entry in kept]
    assert times == sorted(times) and times[-1] == 10.0
    assert tell(kept)[-1].outcome == "STOPPED since then, as far as the journal goes"


@given(st.lists(st.tuples(st.floats(0.0, 3.0), st.sampled_from("abc")), max_size=80))
def test_decisions_are_kept_in_the_order_in_which_they_came(said: list[tuple[float, str]]) -> None:
    """Whichever is held back, and whichever span ends first; none is lost without a count."""
    book, kept, now = Repeats(3, 20.0), list[Entry](), 0.0
    for number, (wait, event) in enumerate(said):
        now += wait
        # The clock of the entries is of no matter: here it counts them.
        kept += book.take(now, decision(1.0 + number, "IDLE", event, "IDLE"))
        kept += book.look(now)
    kept += book.close()
    times = [entry.time for entry in kept if isinstance(entry, Decision)]
    assert times == sorted(times)
    assert sum(e.lost if isinstance(e, Gap) else 1 for e in kept) == len(said)


@given(st.lists(st.tuples(st.floats(0.0, 30.0), st.sampled_from("abc")), max_size=80))
def test_each_entry_is_kept_or_counted(said: list[tuple[float, str]]) -> None:
    """Whatever comes when: entries and gaps add up to what came."""
    book, kept, now = Repeats(3, 20.0), list[Entry](), 0.0
    for wait, source in said:
        now += wait
        kept += [*book.take(now, alarm(source=source)), *book.look(now)]
    kept += book.close()
    assert sum(e.lost if isinstance(e, Gap) else 1 for e in kept) == len(said)
