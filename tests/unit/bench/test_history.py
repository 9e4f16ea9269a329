"""Each figure is one of a commit that the history has, or is told to be in doubt."""

from __future__ import annotations

import functools
import json
from pathlib import Path

import pytest
from harness.workspace import ROOT
from typer import Typer
from typer.testing import CliRunner

from bench import page
from bench.__main__ import main
from bench.history import OLD, figures, git, in_doubt, is_whole, reason
from bench.rows import GROUPS

AUTHOR = ("-c", "user.name=a", "-c", "user.email=a@example.org")


def commit(root: Path, file: str, count: int = 1) -> str:
    """Change a file in so many commits; return the last one."""
    (root / file).parent.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        (root / file).write_text(f"{git(root, 'rev-parse', 'HEAD')} {number}", encoding="utf-8")
        git(root, "add", file)
        assert git(root, *AUTHOR, "commit", "-qm", "a change") is not None
    return str(git(root, "rev-parse", "HEAD"))


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Give a repository with one commit."""
    assert git(tmp_path, "init", "-q") is not None
    commit(tmp_path, "src/farm/a.py")
    return tmp_path


def test_figure_is_old_when_its_room_has_changed_often(clone: Path) -> None:
    """Commits of other rooms do not count."""
    measured = commit(clone, "src/farm/a.py")
    commit(clone, "src/what_if/a.py", 2)
    commit(clone, "src/farm/a.py", 3)
    assert reason(measured, ("src/farm",), clone, 3) == ""
    assert reason(measured, ("src/farm",), clone, 2).startswith("old: src/farm changed in more")
    assert reason(measured, ("src/farm", "src/what_if"), clone, 4).startswith("old: ")


def test_commit_that_is_not_in_the_history_is_named(clone: Path) -> None:
    """Unknown, or of a branch that was left; files that differed are no commit."""
    git(clone, "checkout", "-qb", "left")
    left = commit(clone, "src/farm/a.py")
    git(clone, "checkout", "-q", "-")
    for lost in (left, "3ffe305"):
        assert "is not in the history" in reason(lost, ("src/farm",), clone, OLD)
    assert "differed from commit abc1234" in reason("abc1234+", ("src/farm",), clone, OLD)
    assert reason("", ("src/farm",), clone, OLD) == "of no commit"


def test_each_figure_is_of_the_history_or_told_to_be_in_doubt() -> None:
    """Whoever writes the page again marks what has become old; it may wait as long once more."""
    if not is_whole(ROOT):
        pytest.skip("no clone with its whole history")
    content = json.loads(page.RESULTS.read_text(encoding="utf-8"))
    assert len(list(figures(content))) >= sum(map(len, GROUPS.values()))
    told = content["in_doubt"]
    found = in_doubt(content, ROOT, 2 * OLD)
    unsaid = {name: why for name, why in found.items() if name not in told}
    assert not unsaid, f"./cell bench --page marks them: {unsaid}"
    text = page.TABLES.read_text(encoding="utf-8")
    assert [why for why in told.values() if why not in text] == []


def test_files_that_differ_from_the_commit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything is measured; the pages of figures do not count, and a list needs nothing."""
    monkeypatch.setattr(page, "changed_files", lambda root: {root / "cell", page.PAGE})
    app = Typer()
    app.command()(main)
    for words in ([], ["ik_single"], ["--farm"], ["--stops"]):
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 2 and "cell differ from the commit" in done.output
    assert CliRunner().invoke(app, ["--list"]).exit_code == 0


def test_a_page_that_was_written_makes_no_other_commit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A part that was measured before writes the page; other files that differ are told."""
    monkeypatch.setattr(page, "commit_of", lambda _: "abc1234+")
    monkeypatch.setattr(page, "changed_files", lambda root: {page.RESULTS, page.PAGE})
    assert page.commit() == "abc1234"
    monkeypatch.setattr(page, "changed_files", lambda root: {page.RESULTS, page.ROOT / "env.sh"})
    assert page.commit() == "abc1234+"
    monkeypatch.setattr(page, "commit_of", lambda _: "unknown")
    assert page.commit() == ""


def test_a_commit_that_came_meanwhile_is_not_the_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of both may have run: the figure is told to be in doubt, and of the first."""
    told = iter(["abc1234", "abc1234", "def5678"])
    monkeypatch.setattr(page, "commit_of", lambda _: next(told))
    monkeypatch.setattr(page, "begun_at", functools.cache(page.begun_at.__wrapped__))
    assert page.begun_at() == "abc1234"
    assert page.measured({}, 0.0)["commit"] == "abc1234"
    assert page.measured({}, 0.0)["commit"] == "abc1234+"
