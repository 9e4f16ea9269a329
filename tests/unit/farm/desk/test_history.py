"""Files that are whole or not there, and joined; a desk that is killed at any moment."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from pathlib import Path

import farm.desk.lines.key_figures_io
import pytest
from farm.config import load_farm
from farm.desk.command_line_io import app as farm
from farm.desk.files import counting
from farm.desk.history_io import History, HistoryError, Kept
from farm.desk.reading_io import ask, newest_of
from farm.keys import CellName
from farm.wire import Event, WireError, decode, encode
from harness.processes import free_port, wait_until
from harness.running.thorough import examples, thorough
from harness.yaml_files import copy_configuration
from msgspec.structs import replace
from typer.testing import CliRunner

from bench.synthetic.invented import Invented
from bench.synthetic.running import Practice

A, B = CellName("s", "m", "a"), CellName("s", "m", "b")
READY = "the desk is ready"


def kept(cell: CellName, *numbers: int) -> list[Kept]:
    """Return events to keep."""
    return [Kept(cell, 0, Event(n, n + 0.25, "audit", n % 2 == 0, f"é {n}")) for n in numbers]


def numbers(folder: Path, cell: str = "a") -> list[object]:
    """Return the numbers of a cell in the order in which they are kept."""
    found = ask(folder, "SELECT number FROM events WHERE cell = ?", [cell])
    return [row[0] for row in found.rows]


def test_what_was_kept_is_found(tmp_path: Path) -> None:
    """With its time to the microsecond, and by the next writer."""
    with History(tmp_path, 4, 16.0) as history:
        assert newest_of(tmp_path) == {}
        history.write(kept(A, 1, 2))
        history.write(kept(B, 1))
        history.write([])
    found = ask(tmp_path, "SELECT epoch_us(time), stop, text FROM events ORDER BY cell, number")
    assert found.rows == [(1250000, False, "é 1"), (2250000, True, "é 2"), (1250000, False, "é 1")]
    assert newest_of(tmp_path) == {A: (0, 2, 2.25), B: (0, 1, 1.25)}


def test_small_files_become_one_and_large_ones_stay(tmp_path: Path) -> None:
    """The number of files is bounded; the order stays."""
    with History(tmp_path, 4, 16.0) as history:
        for n in range(1, 24):
            history.write(kept(A, n))
            history.join()
        assert len(list(tmp_path.glob("*.parquet"))) < 5
    assert numbers(tmp_path) == list(range(1, 24))
    with History(tmp_path, 2, 1e-4) as history:
        history.write(kept(A, 24))
        assert history.join() == 0  # each is larger than that


@pytest.mark.parametrize("removed", range(5))
def test_a_writer_killed_while_it_joined_leaves_each_event_once(
    tmp_path: Path, removed: int
) -> None:
    """The large file is there, and so many of the small ones are gone already."""
    with History(tmp_path, 100, 16.0) as history:
        for n in range(1, 5):
            history.write(kept(A, n))
    small = {file.name: file.read_bytes() for file in sorted(tmp_path.glob("*.parquet"))}
    with History(tmp_path, 4, 16.0) as history:
        assert history.join() == 4
    for name in list(small)[removed:]:
        (tmp_path / name).write_bytes(small[name])
    (tmp_path / "000000000005-000000000009.part").write_bytes(b"PAR1 half")
    assert numbers(tmp_path) == [1, 2, 3, 4]
    with History(tmp_path, 4, 16.0) as history:
        history.write(kept(A, 5))
    assert numbers(tmp_path) == [1, 2, 3, 4, 5]
    assert len(list(tmp_path.glob("0*"))) == 2


def test_a_file_that_was_moved_away_is_gone_on_without(tmp_path: Path) -> None:
    """As the desk advises for a damaged one; the others are joined."""
    with History(tmp_path, 3, 16.0) as history:
        for n in range(1, 5):
            history.write(kept(A, n))
        (tmp_path / "000000000002-000000000002.parquet").rename(tmp_path / "away")
        assert history.join() == 3
    assert numbers(tmp_path) == [1, 3, 4]


def test_a_file_that_cannot_be_looked_at_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As what the desk takes for trouble with its history."""

    def failing(self: Path, **_: object) -> os.stat_result:
        raise OSError(5, "Input/output error")

    with History(tmp_path, 1, 16.0) as history:
        history.write(kept(A, 1))
        monkeypatch.setattr(Path, "stat", failing)
        with pytest.raises(HistoryError, match="Input/output error"):
            history.join()


@pytest.mark.parametrize(("number", "time_s"), [(1, 1e308), (1, 1e14), (2**63, 1.0)])
def test_an_event_that_fits_into_no_column_is_no_event(
    number: int, time_s: float, tmp_path: Path
) -> None:
    """It is refused where it comes in; should it come to the history, that says so."""
    event = Event(number, time_s, "audit")
    with pytest.raises(WireError):
        decode(encode(event), Event)
    with History(tmp_path, 4, 16.0) as history, pytest.raises(HistoryError, match="cannot be kept"):
        history.write([Kept(A, 0, event)])


def test_whose_output_nobody_reads_ends_without_a_word(tmp_path: Path) -> None:
    """The signal of a closed pipe stays ignored: a page that is closed would end the desk by it."""
    with History(tmp_path / "events", 4, 16.0) as history:
        history.write(kept(A, *range(1, 3000)))
    words = ["events", "--limit", "3000", "--folder", str(tmp_path)]
    with subprocess.Popen(
        [sys.executable, "-m", "farm", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as listing:
        assert listing.stdout is not None and listing.stderr is not None
        listing.stdout.close()
        assert listing.stderr.read() == b"" and listing.wait() == 1


class Learning(Invented):
    """A cell whose learner does twelve exercises, each wrong at first; the last two remain so."""

    def _body(self, number: int, time: float) -> dict[str, object]:
        # One result comes twice: as from a cell that was killed between entry and mark.
        number -= number == 24 and self.index % 2
        first, exercise = number <= 12, (number - 1) % 12 + 1
        return {
            "kind": "exercise",
            "marked": time,
            "learner": f"learner_{self.index:02d}",
            "exercise": f"e{exercise:02d}_task",
            "title": f"{exercise}. Task",
            "passed": not first and exercise < 11,
            "reason": "so it is",
            "digest": "",
            "signature": f"{self.index}/{number}",
        }


@pytest.mark.parametrize(
    ("kind", "many", "until"),
    [(Invented, 3, 1500), *thorough((Learning, 30, 24))],
    ids=["events", "a class"],
)
def test_desk_killed_at_any_moment_keeps_each_event_once(
    kind: type[Invented], many: int, until: int, tmp_path: Path
) -> None:
    """With -9, again and again, while cells tell and it joins its files."""
    folder = tmp_path / "config"
    folder.mkdir()
    copy_configuration(folder)
    text = (folder / "farm" / "farm.yaml").read_text()
    for old, new in (("flush_ms: 500", "flush_ms: 50"), ("small_files: 64", "small_files: 3")):
        assert old in text
        text = text.replace(old, new)
    (folder / "farm" / "farm.yaml").write_text(text)
    port = free_port()
    shipped = load_farm(folder)
    config = replace(shipped, router=replace(shipped.router, port=port))
    words = ["--no-page", "--folder", str(tmp_path / "farm"), "--router-port", str(port)]
    environment = {**os.environ, "SCARA_CONFIG_DIR": str(folder), "PYTHONUNBUFFERED": "1"}
    events = tmp_path / "farm" / "events"

    def start() -> subprocess.Popen[str]:
        desk = subprocess.Popen(
            [sys.executable, "-m", "farm", *words],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert desk.stdout is not None
        assert any(READY in line for line in desk.stdout), f"it ended with {desk.wait()}"
        return desk

    def count() -> int:
        names = [path.name for path in events.iterdir()] if events.is_dir() else []
        there, _ = counting(names)
        return there[-1].last if there else 0

    chance = random.Random(1)
    # Some events are there before the first desk; the others come while desks are killed.
    cells = [kind(k, time.time() - 5.0, 200.0) for k in range(many)]
    with Practice(config, "m", cells, until) as practice:
        for life in range(examples(2, 4)):
            desk = start()
            try:
                if life == 0:
                    assert practice.join()
                before = count()
                wait_until(
                    lambda before=before: count() > min(before, many * until - 1), 20.0, "events"
                )
                time.sleep(chance.uniform(0.0, 0.3))
            finally:
                desk.kill()
                desk.wait()
                desk.stdout.close()  # type: ignore[union-attr]
        desk = start()
        try:
            wait_until(lambda: count() >= many * until, 30.0, "all events")
        finally:
            desk.kill()
            desk.wait()
            desk.stdout.close()  # type: ignore[union-attr]
    for cell in cells:
        assert numbers(events, cell.name) == list(range(1, until + 1))
    if kind is Learning:
        shown = CliRunner().invoke(farm, ["class", "--folder", str(tmp_path / "farm")]).output
        lines = [line.split() for line in shown.splitlines() if line.startswith("learner_")]
        assert [line[0] for line in lines] == [f"learner_{k:02d}" for k in range(many)]
        # Each of twelve exercises was marked twice, but where the last result was told again.
        expected = {k: ["10", *["+2"] * 10, *(["2", "1"] if k % 2 else ["2", "2"])] for k in (0, 1)}
        assert [line[2:] for line in lines] == [expected[k % 2] for k in range(many)]
        assert "30 learners, 705 results" in shown
