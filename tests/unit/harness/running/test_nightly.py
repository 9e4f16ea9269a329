"""The report of a night says what pytest and the mutants left in their files, and nothing else."""

from __future__ import annotations

import subprocess
import sys
from datetime import date, datetime, timedelta, timezone
from pathlib import Path

import msgspec
import pytest
import typer
from harness.mutants import summary
from harness.mutants.summary import RoomSummary, Summary
from harness.running import nightly
from harness.running.nightly import Night, Part, page, read_part, rooms_of

NIGHT = Night(datetime(2026, 1, 2, 23, 5, tzinfo=timezone.utc), "abc1234", "a processor, 2 cores")
PASSED = {"tests": 0, "clients": 0, "mutants": 0}
TESTS = """
import pytest
def test_passes(): pass
@pytest.mark.parametrize("x", ["a|b"])
def test_fails(x): assert x == "more | than\\nthis"
@pytest.mark.skip(reason="no such thing here")
def test_is_skipped(): pass
@pytest.fixture
def broken(): raise OSError("nothing there")
def test_has_a_broken_fixture(broken): pass
@pytest.fixture
def ends_badly():
    yield
    raise OSError("it stays")
def test_passes_and_ends_badly(ends_badly): pass
"""


def test_all_rooms_come_by_in_any_seven_days() -> None:
    """However many there are, and by few a night."""
    for count in range(1, 30):
        rooms = [str(number) for number in range(count)]
        for first in range(9):
            days = [date(2026, 2, 20) + timedelta(first + k) for k in range(7)]
            nights = [rooms_of(day, rooms) for day in days]
            assert {room for night in nights for room in night} == set(rooms)
            assert all(len(night) == -(-count // 7) for night in nights)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run tests that pass, fail, are skipped and cannot be collected; return pytest's report."""
    folder = tmp_path_factory.mktemp("night")
    (folder / "test_one.py").write_text(TESTS)
    (folder / "test_two.py").write_text(
        "import pytest\npytest.importorskip('nowhere_to_be_found')\n"
    )
    (folder / "test_three.py").write_text("import nowhere_to_be_found\n")
    words = ("-q", "--junitxml=found.xml", "--continue-on-collection-errors", "-p", "no:randomly")
    subprocess.run([sys.executable, "-m", "pytest", *words], cwd=folder, capture_output=True)
    return folder / "found.xml"


def test_a_report_of_pytest_is_read_with_the_reasons(report: Path) -> None:
    """Also of a whole file that was skipped or could not be imported."""
    part = read_part(report)
    assert part is not None
    assert part.seconds > 0.0 and part.passed == 1
    skipped = dict(part.skipped)
    assert skipped["test_one.test_is_skipped"] == "no such thing here"
    assert "could not import 'nowhere_to_be_found'" in skipped["test_two"]
    assert "(" not in skipped["test_two"].partition("'")[0]
    failed = dict(part.failed)
    assert set(failed) == {
        *("test_one.test_fails[a|b]", "test_one.test_has_a_broken_fixture"),
        *("test_one.test_passes_and_ends_badly", "test_three"),
    }
    assert "nothing there" in failed["test_one.test_has_a_broken_fixture"]
    assert len(part.skipped) == 2


def test_the_report_says_what_failed_did_not_end_or_was_not_committed(report: Path) -> None:
    """A part can fail although each of its tests passes; no words of a test break its table."""
    night = msgspec.structs.replace(NIGHT, commit="abc1234+", changed=("cell", "docs/x.md"))
    parts = {"cells": None, "starts": Part(3723.4, 12), "clients": read_part(report)}
    text = page(night, {**PASSED, "clients": 1}, parts, None)
    assert "2026-01-02 23:05 UTC at commit abc1234+ on a processor, 2 cores" in text
    assert "**Failed: clients (exit code 1).**\nNot committed: cell, docs/x.md.\n" in text
    assert "| cells | did not end | | | |" in text and "Their run did not end." in text
    assert "| starts | 1:02:03 | 12 | 0 | 0 |" in text and "| 1 | 4 | 2 |" in text
    (row,) = [line for line in text.splitlines() if "test_fails[" in line]
    assert row.count("|") == 3
    passed = page(NIGHT, PASSED, {}, None)
    assert (
        "All of it passed" in passed and "## Skipped\nNo test.\n\n## Failed\nNo test.\n" in passed
    )


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let a night keep its files in a folder of the test."""
    monkeypatch.setattr(nightly, "BUILD", tmp_path)
    monkeypatch.setattr(nightly, "NIGHT", tmp_path / "nightly.json")
    monkeypatch.setattr(summary, "FILE", tmp_path / "mutants.json")
    return tmp_path


def test_a_night_forgets_the_reports_of_the_last_one(
    build: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A part that dies would else be told with them."""
    for name in ("test_pages.xml", "test_clients.xml", "mutants.json"):
        (build / name).write_text("")
    nightly.begin()
    assert [file.name for file in build.iterdir()] == ["nightly.json"]
    words = capsys.readouterr().out.split()
    today = msgspec.json.decode((build / "nightly.json").read_bytes(), type=Night).begun
    assert words[:2] == ["--seed", f"{today:%Y%m%d}"]
    assert words[2:] and set(words[2:]) <= set(nightly.all_rooms())


@pytest.mark.parametrize(("clients", "code"), [(0, 0), (2, 1)])
def test_the_exit_code_tells_of_all_parts(
    build: Path, report: Path, clients: int, code: int
) -> None:
    """And the report is written either way."""
    (build / "nightly.json").write_bytes(msgspec.json.encode(NIGHT))
    (build / "test_clients.xml").write_bytes(report.read_bytes())
    rooms = {
        "core": RoomSummary(20, 19, 1, 61.0, ("step.py:3 AddNot\n    - a\n    + not a",)),
        "motion": RoomSummary(0, 0, 0, 2.0, sound=False),
    }
    found = Summary(40, 20260102, rooms)
    (build / "mutants.json").write_bytes(msgspec.json.encode(found))
    with pytest.raises(typer.Exit) as ended:
        nightly.write(tests=0, clients=clients, mutants=0, file=build / "page.md")
    assert ended.value.exit_code == code
    text = (build / "page.md").read_text()
    assert "| clients | 0:" in text and "| core | 0:01:01 | 20 | 19 | 1 | 1 |" in text
    assert "./cell test --thorough --mutants 40 --seed 20260102 core motion" in text
    assert "| motion, its tests fail without a mutant | 0:00:02 | 0 | 0 | 0 | 0 |" in text
    assert "step.py:3 AddNot\n    - a\n    + not a\n```" in text
