"""A run of mutants that was ended goes on where it was."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.mutants.record import Record
from harness.mutants.trial import Verdict

PLACE = ("core/step.py", "a = 1\n")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Give the file of a run that has tried one mutant."""
    made = tmp_path / "build" / "mutants.jsonl"
    Record(made, go_on=False).add(*PLACE, Verdict.KILLED)
    return made


def test_a_verdict_is_known_to_the_next_run_that_goes_on(file: Path) -> None:
    """For the very same text of the same module."""
    record = Record(file, go_on=True)
    assert record.known(*PLACE) is Verdict.KILLED
    assert record.known(PLACE[0], "a = 2\n") is None
    assert record.known("core/other.py", PLACE[1]) is None


def test_a_new_run_forgets(file: Path) -> None:
    """Tests may have changed."""
    assert Record(file, go_on=False).known(*PLACE) is None
    assert Record(file, go_on=True).known(*PLACE) is None


def test_half_a_line_of_a_killed_run_is_left_out(file: Path) -> None:
    """What stands before it counts, and what comes after it is read."""
    with file.open("ab") as stream:
        stream.write(b'{"mutant":"12')
    record = Record(file, go_on=True)
    assert record.known(*PLACE) is Verdict.KILLED
    record.add("core/other.py", "", Verdict.SURVIVED)
    assert Record(file, go_on=True).known("core/other.py", "") is Verdict.SURVIVED
