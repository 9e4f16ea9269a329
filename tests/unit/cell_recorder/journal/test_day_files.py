"""The journal's files: numbers without gaps, torn lines, limits; read as they were written."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from cell_recorder.config import load_journal
from cell_recorder.journal.day_files_io import LOCK, DayFiles, JournalError
from cell_recorder.journal.entries import LONGEST_TEXT, AnyEntry, Audit, Gap, Torn, encode, stamped
from cell_recorder.journal.reader_io import journals, read, read_between, utc_day
from harness.yaml_files import CONFIG
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_ros.journal_files_io import numbered

NOON = 1_795_348_800.0  # 2026-11-22 12:00 UTC
DAY = 86400.0
SOFTWARE = 1_686_355_200.0  # 2023-06-10 00:00 UTC: Debian 12
YEARS = 3652 * DAY
TIMES = st.lists(st.floats(-DAY, DAY), max_size=6)
STARTS = st.tuples(TIMES, st.integers(0, 400), st.binary(max_size=6))
JUMPS = st.floats(-4000 * DAY, 4000 * DAY) | st.floats(-4 * DAY, 4 * DAY)
SETTINGS = replace(load_journal(CONFIG), keep_days=100, limit_mb=10.0, day_limit_mb=10.0)


def said(time: float, what: str = "MOVE") -> Audit:
    """Return an entry."""
    return Audit(time=time, who="a program", what=what, success=True, outcome="")


@contextmanager
def opened(folder: Path, now: float = NOON, **changes: Any) -> Iterator[DayFiles]:
    """Open a journal that a process before may have left in any state."""
    files = DayFiles(folder, "milk_2", replace(SETTINGS, **changes))
    files.open(now)
    try:
        yield files
    finally:
        files.close()


def write(files: DayFiles, *entries: Any) -> None:
    """Write some entries one by one, by a clock that shows their time."""
    for entry in entries:
        assert files.append([entry], entry.time) == 1


def numbers(folder: Path, since: int = 0) -> list[int]:
    """Return the numbers that a reader finds; fail at lines that are no entries."""
    return [entry.number for entry in read(folder, since, pytest.fail)]


@contextmanager
def full_disk(patch: pytest.MonkeyPatch, room: int) -> Iterator[None]:
    """Let the disk take so many bytes, and nothing of what is shorter; expect that it is told."""
    real = os.write

    def full(fd: int, data: Any) -> int:
        if len(data) <= room or not room:
            raise OSError(28, "No space left on device")
        return real(fd, data[:room])

    with patch.context() as patched, pytest.raises(OSError, match="No space left"):
        patched.setattr(os, "write", full)
        yield


def test_one_file_a_day_in_utc_and_numbers_go_on_over_days_and_starts(tmp_path: Path) -> None:
    """The format that others read."""
    with opened(tmp_path) as files:
        write(files, said(NOON), said(NOON + DAY), said(NOON + DAY + 1.0))
    with opened(tmp_path, NOON + 2 * DAY) as files:
        write(files, said(NOON + 2 * DAY))
    names = sorted(path.name for path in tmp_path.glob("*.jsonl"))
    assert names == ["2026-11-22.jsonl", "2026-11-23.jsonl", "2026-11-24.jsonl"]
    assert numbers(tmp_path) == [1, 2, 3, 4]
    assert numbers(tmp_path, 2) == [3, 4] and numbers(tmp_path, 4) == []
    line = (tmp_path / names[0]).read_text()
    assert line.startswith('{"kind":"audit","number":1,"time":1795348800.0,"cell":"milk_2",')


@given(starts=st.lists(STARTS, min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_numbers_have_no_gap_whatever_is_torn(
    starts: list[tuple[list[float], int, bytes]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Any clock within a day, any cut through the newest file, any bytes behind it.

    What stood whole before the cut is read again; what did not is kept aside and told.
    """
    folder = tmp_path_factory.mktemp("journal")
    kept: list[AnyEntry] = []
    for times, cut, behind in starts:
        with opened(folder, NOON) as files:
            torn = [entry for entry in files.told if isinstance(entry, Torn)]
            assert all((folder / entry.kept).stat().st_size >= entry.size for entry in torn)
            found = list(read(folder, 0, pytest.fail))
            assert found[: len(kept)] == kept
            write(files, *(said(NOON + time) for time in times))
        whole = list(read(folder, 0, pytest.fail))
        assert [entry.number for entry in whole] == list(range(1, len(whole) + 1))
        newest = max(folder.glob("*.jsonl"))
        content = newest.read_bytes()
        left = content[: max(0, len(content) - cut)]
        newest.write_bytes(left + behind)
        gone = content.count(b"\n") - left.count(b"\n")
        kept = whole[: len(whole) - gone]


@pytest.mark.parametrize(
    "torn",
    [b'{"kind":"au', b"\0" * 5000, b"\xff\xfe\n\n", b"{}\n", b"x" * 3_000_000],
    ids=["half", "zeros", "no text", "no entry", "longer than what is looked at first"],
)
def test_torn_end_is_kept_aside_and_told(tmp_path: Path, torn: bytes) -> None:
    """Nothing is swallowed: the bytes are in a file that the entry names."""
    with opened(tmp_path) as files:
        write(files, said(NOON), said(NOON))
    path = tmp_path / "2026-11-22.jsonl"
    path.write_bytes(path.read_bytes() + torn)
    with opened(tmp_path) as files:
        (told,) = files.told
        assert isinstance(told, Torn)
        assert (told.file, told.kept, told.size) == (path.name, "2026-11-22.torn", len(torn))
        write(files, told)
    assert (tmp_path / told.kept).read_bytes() == torn.removesuffix(b"\n") + b"\n"
    assert numbers(tmp_path) == [1, 2, 3]


def test_line_that_lacks_its_end_only_is_whole(tmp_path: Path) -> None:
    """All of the entry is there; nobody read it before, and its number is not given again."""
    with opened(tmp_path) as files:
        write(files, said(NOON), said(NOON))
    path = tmp_path / "2026-11-22.jsonl"
    path.write_bytes(path.read_bytes()[:-1])
    assert numbers(tmp_path) == [1]
    with opened(tmp_path) as files:
        assert files.told == []
        write(files, said(NOON))
    assert numbers(tmp_path) == [1, 2, 3]


def test_clock_that_is_set_back_writes_on_into_the_newest_file(tmp_path: Path) -> None:
    """Numbers grow from file to file; times are found all the same.

    One entry from the future is of today: a wrong stamp says nothing of this machine's clock.
    """
    with opened(tmp_path) as files:
        write(files, said(NOON))
        files.append([said(NOON + YEARS)], NOON)
        write(files, said(NOON), said(NOON - 2 * DAY))
    assert [path.name for path in tmp_path.glob("*.jsonl")] == ["2026-11-22.jsonl"]
    early = read_between(tmp_path, NOON - 3 * DAY, NOON - DAY)
    assert numbers(tmp_path) == [1, 2, 3, 4] and [entry.number for entry in early] == [4]


def test_clock_that_jumps_ten_years_and_back_goes_on_in_todays_file(tmp_path: Path) -> None:
    """What was written meanwhile is put aside and named, whole; no number is given twice."""
    with opened(tmp_path) as files:
        write(files, said(NOON), said(NOON + YEARS), said(NOON + YEARS + DAY), said(NOON + 60.0))
        assert files.path.name == "2026-11-22.jsonl"
    assert [path.name for path in tmp_path.glob("*.jsonl")] == ["2026-11-22.jsonl"]
    before, gap, after = read(tmp_path, 0, pytest.fail)
    assert [entry.number for entry in (before, gap, after)] == [1, 4, 5]
    assert isinstance(gap, Gap) and not gap.lost and gap.time == NOON + 60.0
    assert gap.why == (
        "this machine's clock was ahead and is right again: put aside "
        "2036-11-21.jsonl as 2036-11-21.future, 2036-11-22.jsonl as 2036-11-22.future"
    )
    aside = [numbered(path.read_bytes().strip()) for path in sorted(tmp_path.glob("*.future"))]
    assert [each.number for each in aside if each is not None] == [2, 3]
    # Each day for two months, as long as a day's limit lasts beyond the 53 days of before.
    with opened(tmp_path, NOON + DAY, day_limit_mb=0.001) as files:
        for day in range(1, 60):
            write(files, said(NOON + day * DAY))
            assert files.path.name == f"{utc_day(NOON + day * DAY)}.jsonl"
    assert numbers(tmp_path, 5) == list(range(6, 65))


def test_a_start_finds_files_from_the_future(tmp_path: Path) -> None:
    """Of a journal that ended while its clock was ahead, with a torn line; and once more."""
    for round_ in (1, 2):
        with opened(tmp_path, NOON + YEARS) as files:
            write(files, said(NOON + YEARS))
            last = files.last_number
        path = tmp_path / "2036-11-21.jsonl"
        path.write_bytes(path.read_bytes() + b'{"kind":"au')
        with opened(tmp_path) as files:
            (torn,) = files.told
            assert isinstance(torn, Torn) and torn.file == path.name
            assert files.last_number == last + 1 and files.path.name == "2026-11-22.jsonl"
        assert len(list(tmp_path.glob("*.future"))) == round_
    assert (tmp_path / "2036-11-21.2.future").is_file()
    assert numbers(tmp_path) == [2, 4]


def test_numbers_go_on_where_todays_file_has_none_yet(tmp_path: Path) -> None:
    """Somebody has removed it, or the power went before its first line was safe."""
    with opened(tmp_path) as files:
        write(files, said(NOON + YEARS), said(NOON))
        assert files.last_number == 3
    (tmp_path / "2026-11-22.jsonl").unlink()
    with opened(tmp_path) as files:
        write(files, said(NOON))
    assert numbers(tmp_path) == [2]  # that of the last entry that was put aside is 1


@pytest.mark.parametrize(
    ("begun", "right"), [(60.0, False), (SOFTWARE - 61.0, False), (SOFTWARE - 1.0, True)]
)
def test_a_machine_that_does_not_know_the_time_yet_puts_nothing_aside(
    tmp_path: Path, begun: float, right: bool
) -> None:
    """Its clock is older than its software: then the files are right, and the clock is not.

    It may be right from the day on which the oldest software of a cell came out.
    """
    with opened(tmp_path) as files:
        write(files, said(NOON))
    with opened(tmp_path, begun + right) as files:
        write(files, said(begun + 1.0))
        names = {path.name for path in tmp_path.glob("20*")}
        assert names == ({"2026-11-22.future", "2023-06-10.jsonl"} if right else {files.path.name})
        write(files, said(NOON + 1.0))
    assert numbers(tmp_path)[-1] == (4 if right else 3)


def test_a_journal_that_is_not_open_holds_nothing(tmp_path: Path) -> None:
    """To the byte; what lies there already is counted once it is opened."""
    with opened(tmp_path) as files:
        write(files, said(NOON))
        size = files.path.stat().st_size
    again = DayFiles(tmp_path, "milk_2", SETTINGS)
    assert again.held_mb == 0.0
    again.open(NOON)
    assert again.held_mb == size * 1e-6
    again.close()


@pytest.mark.parametrize("limit", ["day_limit_mb", "limit_mb"])
def test_what_just_fits_is_kept(tmp_path: Path, limit: str) -> None:
    """To the byte."""
    entries = [said(NOON), said(NOON + DAY)] if limit == "limit_mb" else [said(NOON)] * 2
    size = 2 * len(encode(stamped(said(NOON), 1, "milk_2")))
    entries[1] = replace(entries[1], what="x" * (2000 - size + len("MOVE")))
    with opened(tmp_path, **{limit: 0.002}) as files:
        write(files, *entries)
        assert files.held_mb == 0.002 and not files.told
        if limit == "limit_mb":
            write(files, said(NOON + DAY))
            assert [type(each) for each in files.told] == [Gap]
        else:
            with pytest.raises(JournalError, match="has come to day_limit_mb"):
                write(files, said(NOON))


def test_a_byte_too_much_is_too_much(tmp_path: Path) -> None:
    """The oldest day goes for it."""
    size = 2 * len(encode(stamped(said(NOON), 1, "milk_2")))
    longer = said(NOON + DAY, "x" * (2000 - size + len("MOVE") + 1))
    with opened(tmp_path, limit_mb=0.002) as files:
        write(files, said(NOON), longer)
        assert [type(each) for each in files.told] == [Gap]


def test_a_disk_that_is_full_when_the_clock_comes_back_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The files stay where they are until the entry that names them is written."""
    with opened(tmp_path) as files:
        write(files, said(NOON), said(NOON + YEARS))
        with full_disk(monkeypatch, 0):
            files.append([said(NOON)], NOON)
        assert not files.is_open and not list(tmp_path.glob("*.future"))
        files.open(NOON)
        write(files, said(NOON))
    assert numbers(tmp_path) == [1, 3, 4] and len(list(tmp_path.glob("*.future"))) == 1


def test_what_was_put_aside_makes_room_first(tmp_path: Path) -> None:
    """It counts to limit_mb, and nobody reads it any more."""
    with opened(tmp_path, limit_mb=0.01) as files:
        write(files, said(NOON, "x" * 400), *(said(NOON + YEARS, "x" * 400) for _ in range(9)))
        write(files, *(said(NOON + n, "x" * 400) for n in range(14)))
    assert numbers(tmp_path)[0] == 1 and not list(tmp_path.glob("*.future"))


@given(jumps=st.lists(JUMPS, min_size=1, max_size=6))
@settings(max_examples=40, deadline=None)
def test_no_number_is_given_twice_whatever_the_clock_does(
    jumps: list[float], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Over all files, those aside too; and the journal is never behind its newest entry."""
    folder = tmp_path_factory.mktemp("journal")
    newest = 0
    for jump in (*jumps, 0.0):
        with opened(folder, NOON + jump) as files:
            write(files, said(NOON + jump), said(NOON))
            assert files.last_number >= newest + 2
            newest = files.last_number
    paths = [path for path in folder.iterdir() if path.suffix in (".jsonl", ".future")]
    lines = b"".join(path.read_bytes() for path in paths).splitlines()
    given_ = [found.number for found in map(numbered, lines) if found is not None]
    assert sorted(given_) == list(range(1, newest + 1))
    # A clock that was ahead by two days at most writes on into that file.
    assert max(folder.glob("*.jsonl")).name <= "2026-11-24.jsonl"
    read_again = numbers(folder)
    assert read_again == sorted(read_again) and read_again[-1] == newest


def test_entries_of_a_time(tmp_path: Path) -> None:
    """The start counts, the end does not; files of days before are not opened."""
    with opened(tmp_path) as files:
        write(files, *(said(NOON + n * DAY) for n in range(4)))
    (tmp_path / "2026-11-22.jsonl").write_text("no entry\n")
    found = read_between(tmp_path, NOON + DAY, NOON + 3 * DAY, pytest.fail)
    assert [entry.number for entry in found] == [2, 3]


def test_line_that_is_no_entry_is_told_and_the_rest_is_read(tmp_path: Path) -> None:
    """A broken block in the middle of a file."""
    with opened(tmp_path) as files:
        write(files, said(NOON))
    path = tmp_path / "2026-11-22.jsonl"
    behind = b'{"kind": "nobody"}\n' + encode(stamped(said(NOON), 2, "milk_2"))
    path.write_bytes(path.read_bytes() + behind)
    bad: list[str] = []
    assert [entry.number for entry in read(tmp_path, 0, bad.append)] == [1, 2]
    assert len(bad) == 1 and f"{path}, line 2: is no entry" in bad[0]


def test_old_files_are_removed_whole_and_that_is_told(tmp_path: Path) -> None:
    """The newest days stay; what goes is named."""
    with opened(tmp_path, keep_days=3) as files:
        write(files, *(said(NOON + n * DAY) for n in range(4)))
        (told,) = files.told
    assert isinstance(told, Gap) and told.removed == ["2026-11-22.jsonl"]
    assert "keep_days = 3" in told.why and not told.lost
    assert (told.since, told.until) == (0.0, 0.0), "no entry was lost, so there is no time of it"
    assert numbers(tmp_path) == [2, 3, 4]


def test_a_file_that_somebody_has_removed_takes_no_other_with_it(tmp_path: Path) -> None:
    """It counts no longer: what is left has room."""
    with opened(tmp_path, limit_mb=0.002) as files:
        write(files, said(NOON, "x" * 800), said(NOON + DAY, "x" * 300), said(NOON + 2 * DAY))
        (tmp_path / "2026-11-22.jsonl").unlink()
        write(files, said(NOON + 2 * DAY, "x" * 500))
        assert not files.told
        assert files.held_mb == sum(path.stat().st_size for path in tmp_path.glob("20*")) * 1e-6
    assert numbers(tmp_path) == [2, 3, 4]


def test_beyond_the_limit_the_oldest_go(tmp_path: Path) -> None:
    """As many as make room: a burst takes the place of several days, those behind them stay."""
    with opened(tmp_path, limit_mb=0.01) as files:
        for day in range(4):
            write(files, *(said(NOON + day * DAY, "x" * 400) for _ in range(4)))
        write(files, *(said(NOON + 4 * DAY, "x" * 400) for _ in range(12)))
        size = sum(path.stat().st_size for path in tmp_path.glob("*.jsonl"))
        assert size <= 10_000 and abs(files.held_mb * 1e6 - size) < 1.0
        assert {type(each) for each in files.told} == {Gap}
    assert numbers(tmp_path) == list(range(13, 29)), "three days of four entries are gone"


def test_a_flood_ends_at_the_limit_of_a_day_and_the_next_day_goes_on(tmp_path: Path) -> None:
    """The error says what to do; what was written stays whole."""
    with opened(tmp_path, day_limit_mb=0.001) as files:
        with pytest.raises(JournalError, match=r"day_limit_mb = 0\.001 of journal\.yaml"):
            while True:
                write(files, said(NOON))
        count = files.last_number
        write(files, said(NOON + DAY))
    assert numbers(tmp_path) == list(range(1, count + 2))


def test_what_waited_at_the_limit_of_a_day_goes_into_the_next_one(tmp_path: Path) -> None:
    """It has the time at which it came, the day before."""
    with opened(tmp_path, day_limit_mb=0.001) as files:
        with pytest.raises(JournalError):
            while True:
                write(files, said(NOON))
        count = files.last_number
        assert files.append([said(NOON)], NOON + DAY) == 1
        assert files.path.name == "2026-11-23.jsonl"
    assert numbers(tmp_path) == list(range(1, count + 2))


def test_full_disk_takes_a_whole_line_or_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a line is cut off, and the number is given to the next one."""
    with opened(tmp_path) as files:
        write(files, said(NOON))
        with full_disk(monkeypatch, 20):
            files.append([said(NOON)], NOON)
        write(files, said(NOON))
    assert numbers(tmp_path) == [1, 2]


def test_two_writers_of_one_journal_are_refused(tmp_path: Path) -> None:
    """The second one is told who writes, and what to do."""
    refused = pytest.raises(JournalError, match=rf"process {os.getpid()}, .*--name")
    with opened(tmp_path), refused:
        DayFiles(tmp_path, "milk_2", SETTINGS).open(NOON)
    with opened(tmp_path):
        pass


def test_a_journal_is_written_by_nobody_else(tmp_path: Path) -> None:
    """Whatever this process leaves open of files that name no rights."""
    before = os.umask(0)
    try:
        with opened(tmp_path) as files:
            modes = {path.stat().st_mode & 0o777 for path in (files.path, tmp_path / LOCK)}
    finally:
        os.umask(before)
    assert modes == {0o644}


def test_numbers_go_on_where_somebody_removed_the_file(tmp_path: Path) -> None:
    """It is told, and no number is given twice."""
    with opened(tmp_path) as files:
        write(files, said(NOON), said(NOON))
        files.path.unlink()
        with pytest.raises(JournalError, match=r"2026-11-22\.jsonl was removed by somebody"):
            files.sync()
        files.open(NOON)
        write(files, *files.told, said(NOON))
    assert numbers(tmp_path) == [3, 4]


def test_a_file_that_was_removed_in_the_night_is_begun_anew(tmp_path: Path) -> None:
    """The next day's first entry finds it; nobody else would close it."""
    with opened(tmp_path) as files:
        write(files, said(NOON))
        files.sync()
        files.path.unlink()
        with pytest.raises(JournalError, match="was removed"):
            files.append([said(NOON + DAY)], NOON + DAY)
        assert not files.is_open
        files.open(NOON + DAY)
        write(files, *files.told, said(NOON + DAY))
    assert numbers(tmp_path) == [2, 3]


def test_texts_of_any_kind_fit_into_a_line(tmp_path: Path) -> None:
    """What a client sends may be long, or no text at all."""
    with opened(tmp_path) as files:
        write(files, said(NOON, "x" * 100_000), said(NOON, "a\ud800b\nc\u2028d"))
    long, odd = read(tmp_path)
    assert isinstance(long, Audit) and len(long.what) == LONGEST_TEXT + 3
    assert isinstance(odd, Audit) and odd.what == "a?b\nc\u2028d"


def test_journals_are_found_by_the_names_of_their_cells(tmp_path: Path) -> None:
    """A namespace below another one is a folder below another one."""
    for name in ("cell", "hall", "hall/cell_2"):
        with opened(tmp_path / "journal" / name) as files:
            write(files, said(NOON))
    assert set(journals(tmp_path)) == {"cell", "hall", "hall/cell_2"}
    assert numbers(tmp_path / "journal" / "hall") == [1]
    assert journals(tmp_path / "nowhere") == {} and numbers(tmp_path / "nowhere") == []
