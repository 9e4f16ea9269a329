"""A journal is read by number, also while it is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from farm.link.journal_io import JournalFiles

from scara_ros import journal_files_io as journal_files


def line(number: int) -> str:
    """Return a line of a journal."""
    body = {"number": number, "time": float(number), "kind": "note", "cell": "c"}
    return json.dumps({**body, "filler": "x" * (number % 50)}) + "\n"


def write(folder: Path, day: str, numbers: range) -> None:
    """Write a day."""
    (folder / f"{day}.jsonl").write_text("".join(map(line, numbers)))


@pytest.fixture
def days(tmp_path: Path) -> Path:
    """Return a folder with three days, numbers 11 to 900, and things that are no journal."""
    write(tmp_path, "2026-05-01", range(11, 400))
    write(tmp_path, "2026-05-02", range(400, 401))
    write(tmp_path, "2026-05-03", range(401, 901))
    (tmp_path / "2026-05-03.torn").write_text("half")
    (tmp_path / ".lock").write_text("1")
    return tmp_path


@pytest.mark.parametrize("block", [64, 1 << 16])
@pytest.mark.parametrize("since", [0, 10, 11, 12, 398, 399, 400, 401, 640, 899])
def test_any_number_is_found(
    days: Path, since: int, block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By bisection in a day, and over days."""
    monkeypatch.setattr(journal_files, "BLOCK", block)
    found = JournalFiles(days).read(since, 7)
    assert (found.first, found.last) == (11, 900)
    first = max(since + 1, 11)
    assert [e.number for e in found.events] == list(range(first, min(first + 7, 901)))
    assert found.events[0].text == f"filler {'x' * (first % 50)}".strip()
    assert found.events[0].body["cell"] == "c"


def test_nothing_after_the_last(days: Path) -> None:
    """Nor beyond it, where a desk has seen an older journal."""
    for since in (900, 5000):
        assert JournalFiles(days).read(since, 7).events == ()


def test_an_empty_or_missing_folder_is_an_empty_journal(tmp_path: Path) -> None:
    """A cell that was just set up."""
    assert JournalFiles(tmp_path / "nowhere").bounds() == (0, 0)
    (tmp_path / "2026-05-01.jsonl").write_text("")
    assert JournalFiles(tmp_path).read(0, 5).events == ()


@pytest.mark.parametrize("cut", [1, 10, 40])
def test_a_line_that_is_being_written_comes_when_it_is_whole(tmp_path: Path, cut: int) -> None:
    """And the same reader finds it then."""
    write(tmp_path, "2026-05-01", range(1, 4))
    file, reader, last = tmp_path / "2026-05-01.jsonl", JournalFiles(tmp_path), line(4)
    with file.open("a") as stream:
        stream.write(last[:cut])
    assert [e.number for e in reader.read(1, 9).events] == [2, 3] and reader.bounds().last == 3
    with file.open("a") as stream:
        stream.write(last[cut:])
    assert [e.number for e in reader.read(1, 9).events] == [2, 3, 4]


def test_a_new_day_whose_first_line_is_not_whole(tmp_path: Path) -> None:
    """The days before it are there."""
    write(tmp_path, "2026-05-01", range(1, 4))
    (tmp_path / "2026-05-02.jsonl").write_text('{"numb')
    reader = JournalFiles(tmp_path)
    assert reader.bounds() == (1, 3)
    write(tmp_path, "2026-05-02", range(4, 6))
    assert [e.number for e in reader.read(2, 9).events] == [3, 4, 5]


def test_a_bad_line_is_left_out(tmp_path: Path) -> None:
    """Its number is missing, and all others are there, also where it begins a day."""
    odd = '{"number": 3, "time": 3.0, "kind": "cycle", "end": "x"}\n'
    text = line(1) + line(2) + "no JSON\n" + odd + line(4) + '{"number": 5}\n'
    (tmp_path / "2026-05-01.jsonl").write_text(text)
    (tmp_path / "2026-05-02.jsonl").write_text("no JSON\n" + line(6))
    found = JournalFiles(tmp_path).read(0, 9)
    assert [e.number for e in found.events] == [1, 2, 4, 6] and found.last == 6


def test_a_day_that_was_removed_is_gone(days: Path) -> None:
    """The journal is bounded; who asks for what is gone gets what is left."""
    reader = JournalFiles(days)
    assert reader.bounds().first == 11
    (days / "2026-05-01.jsonl").unlink()
    assert reader.bounds() == (400, 900)
    assert reader.read(20, 1).events[0].number == 400
