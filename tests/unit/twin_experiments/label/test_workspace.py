"""What the reporting machine says of itself."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from twin_experiments.workspace_io import commit_of, processor_of, this_workspace


def git(folder: Path, *words: str) -> str:
    """Run git in ``folder``; return what it said."""
    who = ("-c", "user.name=Somebody", "-c", "user.email=somebody@example.org")
    done = subprocess.run(
        ["git", "-C", str(folder), *who, *words], check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


def test_the_commit_is_named_and_marked_if_a_file_differs(tmp_path: Path) -> None:
    """Seven digits, then a plus."""
    git(tmp_path, "init", "--quiet")
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "file").write_text("one")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--quiet", "--message", "Begin")
    expected = git(tmp_path, "rev-parse", "HEAD")[:7]
    assert commit_of(tmp_path / "inner") == expected
    (tmp_path / "inner" / "file").write_text("two")
    assert commit_of(tmp_path / "inner") == f"{expected}+"


def test_outside_a_clone_and_without_git_the_commit_is_unknown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A report is written all the same."""
    assert commit_of(tmp_path) == "unknown"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert commit_of(tmp_path) == "unknown"


def test_the_processor_is_named(tmp_path: Path) -> None:
    """The first one of the listing; without a listing it is unknown."""
    listing = tmp_path / "cpuinfo"
    listing.write_text("processor\t: 0\nmodel name\t: Quick One @ 3 GHz\nmodel name\t: Other\n")
    assert processor_of(listing) == "Quick One @ 3 GHz"
    assert processor_of(tmp_path / "missing") == "unknown"


def test_this_workspace_has_all_fields() -> None:
    """Versions of what decides the figures, and the number of cores."""
    here = this_workspace()
    assert list(here.versions) == ["twin_experiments", "Python", "numpy", "pybullet"]
    assert here.versions["twin_experiments"] == "1.0.0"
    assert here.cores == os.cpu_count()
    assert here.now.tzinfo is not None
