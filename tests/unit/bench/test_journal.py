"""A campaign that was ended goes on where it was, and only with what was measured."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import pytest
from harness.faults.rows import Row
from harness.workspace import ROOT

if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from bench.journal import NAME, Journal, JournalError, unfinished

ROWS = [
    Row("cut", "found after [s]", 0.1, 0.02),
    Row("cut", "data lost [s]", 0.2, math.inf, always=True),
]


def git(root: Path, *words: str) -> None:
    """Run git in ``root``."""
    who = ("-c", "user.name=n", "-c", "user.email=e")
    subprocess.run(["git", "-C", str(root), *who, *words], check=True, capture_output=True)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """Return a small project under git."""
    root = tmp_path / "project"
    for name in ("src/a.py", "docs/b.md"):
        path = root / name
        path.parent.mkdir(parents=True)
        path.write_text("1\n")
    git(root, "init")
    git(root, "add", "-A")
    git(root, "commit", "-m", "one")
    return root


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the folder of a campaign."""
    folder = tmp_path / "runs" / "2026"
    folder.mkdir(parents=True)
    return folder


def test_what_was_measured_is_taken_once_in_its_order(folder: Path, root: Path) -> None:
    """A new journal knows nothing; a continued one each run of a scenario, then nothing more.

    Figures stay, infinity too.
    """
    first = Journal(folder, root)
    assert first.take("cut") is None
    first.add("cut", ROWS, 1.23, [])
    first.add("cut", ROWS[:1], 4.0, ["missed"])
    again = Journal(folder, root)
    assert again.take("cut") == (ROWS, 1.2, [])
    assert again.take("freeze") is None
    assert again.take("cut") == (ROWS[:1], 4.0, ["missed"])
    assert again.take("cut") is None


def test_an_entry_that_was_not_written_to_its_end_is_measured_again(
    folder: Path, root: Path
) -> None:
    """The campaign was killed while it wrote; what comes next begins on a line of its own."""
    Journal(folder, root).add("cut", ROWS, 1.0, [])
    with (folder / NAME).open("a") as journal:
        journal.write('{"scenario": "cut", "sec')
    again = Journal(folder, root)
    assert again.take("cut") is not None and again.take("cut") is None
    again.add("cut", ROWS, 2.0, [])
    assert len((folder / NAME).read_text().splitlines()) == 2


@pytest.mark.parametrize(("changed", "refused"), [("src/a.py", True), ("docs/b.md", False)])
@pytest.mark.parametrize("committed", [True, False])
def test_figures_of_another_version_are_not_mixed(
    folder: Path, root: Path, changed: str, committed: bool, refused: bool
) -> None:
    """Committed or not; a text that is not part of the product does not matter."""
    Journal(folder, root).add("cut", ROWS, 1.0, [])
    (root / changed).write_text("2\n")
    if committed:
        git(root, "commit", "-am", "two")
    if not refused:
        assert Journal(folder, root).take("cut") is not None
        return
    with pytest.raises(
        JournalError, match=r"(?s)has changed since, begin a new campaign:.*src/a\.py"
    ):
        Journal(folder, root)


def test_without_git_nobody_could_tell_which_version_was_measured(
    folder: Path, tmp_path: Path
) -> None:
    """Said at the beginning, not after two hours."""
    with pytest.raises(
        JournalError, match=r"git rev-parse in .*: a campaign notes which version it measured"
    ):
        Journal(folder, tmp_path)


def test_the_newest_campaign_without_a_table_is_continued(tmp_path: Path) -> None:
    """One that has its table has ended; without any this is said."""
    with pytest.raises(JournalError, match="no campaign to be continued"):
        unfinished(tmp_path)
    for name in ("1", "2", "3", "4"):
        (tmp_path / name).mkdir()
        if name != "4":
            (tmp_path / name / NAME).touch()
    (tmp_path / "3" / "bench.json").touch()
    assert unfinished(tmp_path) == tmp_path / "2"
