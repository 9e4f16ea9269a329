"""Names of files, questions and their answers as text."""

from __future__ import annotations

import runpy
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from farm.config import loopback_refusal
from farm.desk.command_line_io import app
from farm.desk.files import EventSpan, counting, to_join
from farm.desk.history_io import History, Kept
from farm.desk.questions import QuestionError, Wanted, query, since, week
from farm.wire import Command, Event, WireError, decode
from typer.testing import CliRunner
from unit.farm.conftest import CELL

from farm import keys

NOW = datetime(2026, 5, 2, 12, 30, tzinfo=timezone(timedelta(hours=2)))
SPANS = [EventSpan(1, 2), EventSpan(3, 3), EventSpan(4, 9)]


@pytest.mark.parametrize(
    ("there", "kept"),
    [
        ([], []),
        (SPANS, SPANS),
        ([*SPANS, EventSpan(1, 9)], [EventSpan(1, 9)]),
        ([*SPANS, EventSpan(3, 9)], [EventSpan(1, 2), EventSpan(3, 9)]),
        ([EventSpan(4, 9), EventSpan(1, 3)], [EventSpan(1, 3), EventSpan(4, 9)]),
    ],
)
def test_files_that_another_one_holds_do_not_count(
    there: list[EventSpan], kept: list[EventSpan]
) -> None:
    """Whatever moment the writer was killed in."""
    names = [span.name for span in there]
    assert counting([*names, "lock", "000000000001-000000000002.part"])[0] == kept


@pytest.mark.parametrize(
    ("sizes", "joined"),
    [([5, 5, 5], SPANS), ([100, 5, 5], []), ([5, 5, 100], [])],
)
def test_only_the_small_ones_in_a_row_at_the_end_are_joined(
    sizes: list[int], joined: list[EventSpan]
) -> None:
    """So that places stay in their order."""
    assert to_join(SPANS, sizes, most=3, large=50) == joined


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("today", "2026-05-02T00:00+02:00"),
        ("yesterday", "2026-05-01T00:00+02:00"),
        ("90m", "2026-05-02T11:00+02:00"),
        ("1.5d", "2026-05-01T00:30+02:00"),
        ("2h", "2026-05-02T10:30+02:00"),
        ("60s", "2026-05-02T12:29+02:00"),
        ("2w", "2026-04-18T12:30+02:00"),
        ("2026-05-01", "2026-05-01T00:00+02:00"),
        ("2026-05-01 22:00", "2026-05-01T22:00+02:00"),
        ("2026-05-01T22:00+00:00", "2026-05-01T22:00+00:00"),
    ],
)
def test_a_beginning_is_understood(text: str, moment: str) -> None:
    """In this machine's zone."""
    assert since(text, NOW) == datetime.fromisoformat(moment).timestamp()


@pytest.mark.parametrize("day", ["2025-01-15", "2025-07-01"])
@pytest.mark.usefixtures("berlin")
def test_a_time_is_meant_as_clocks_showed_it_then(day: str, tmp_path: Path) -> None:
    """In the other half of the year it is another hour."""
    eight = datetime.fromisoformat(f"{day}T08:00").timestamp()
    with History(tmp_path / "events", 4, 16.0) as history:
        for number, at in enumerate((eight - 60.0, eight + 60.0), 1):
            history.write([Kept(CELL, 0, Event(number, at, "audit"))])
    words = ["events", "--since", f"{day}T08:00", "--folder", str(tmp_path)]
    assert "1 rows" in CliRunner().invoke(app, words).output


@pytest.mark.usefixtures("berlin")
def test_a_week_in_which_clocks_change_is_an_hour_shorter() -> None:
    """From Monday to Monday as people count."""
    begin, end = week("2026-W13", datetime(2026, 11, 18, 12))
    assert end - begin == 167 * 3600.0


@pytest.mark.parametrize("text", ["", "12", "last week", "2026-13-01"])
def test_another_beginning_is_refused(text: str) -> None:
    """The text says what is allowed."""
    with pytest.raises(QuestionError, match="allowed are today, yesterday, 30m"):
        since(text, NOW)


def test_words_of_a_question_never_become_sql() -> None:
    """They are values, whatever they hold."""
    statement, values = query(Wanted(cell="x'; DROP TABLE events; --", kind="'", stops=True))
    assert "DROP" not in statement and statement.count("?") == len(values)


def test_a_beginning_is_asked_for_in_microseconds() -> None:
    """As the files have it."""
    _, values = query(Wanted(since=NOW.timestamp() + 0.25, cell="a"))
    assert values[:2] == [int(NOW.timestamp()) * 1_000_000 + 250_000, "a"]


@pytest.mark.parametrize(
    ("word", "chosen"),
    [("all", "m/a m/b n/a"), ("b", "m/b"), ("n/a", "n/a")],
)
def test_a_cell_is_chosen_by_its_name(word: str, chosen: str) -> None:
    """Or with its machine."""
    there = [keys.CellName("s", *text.split("/")) for text in ("n/a", "m/b", "m/a")]
    assert " ".join(map(str, keys.choose(word, there))) == chosen
    with pytest.raises(keys.ChoiceError, match="a: means several: m/a, n/a"):
        keys.choose("a", there)
    with pytest.raises(keys.ChoiceError, match="c: is not there: m/a"):
        keys.choose("c", there)
    with pytest.raises(keys.ChoiceError, match="no cell is there"):
        keys.choose("all", [])


@pytest.mark.parametrize("part", ["", "a/b", "*", "a b", "$x", "x" * 64])
def test_names_that_mean_something_to_the_bus_are_refused(part: str) -> None:
    """A star would be all cells."""
    with pytest.raises(keys.CellNameError, match="cell = "):
        keys.checked("s", "m", part)
    with pytest.raises(keys.CellNameError, match="is no key of a cell"):
        keys.owner("s/m/c")
    with pytest.raises(keys.CellNameError, match="cell = "):
        keys.owner("s/m/*/alive")


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b'{"id": 1}', b"\xff", b'{"id": "\xff"}'])
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    """At the border."""
    with pytest.raises(WireError, match="Command: "):
        decode(data, Command)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.4", "desk.example", "::", ""])
def test_only_this_machine_may_listen(host: str) -> None:
    """Others come in with certificates, and the text says how."""
    assert "--listen" in loopback_refusal(host)
    assert [loopback_refusal(own) for own in ("127.0.0.1", "127.3.2.1", "::1", "localhost")] == [
        ""
    ] * 4


def test_the_module_is_the_command_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """./cell farm runs it by its name, with the words of all its parts."""
    monkeypatch.setattr(sys, "argv", ["farm", "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_module("farm", run_name="__main__")
    assert end.value.code == 0
    shown = capsys.readouterr().out
    for word in ("shelve", "compare", "kpi", "revoke", "fetch", "roll"):
        assert word in shown
