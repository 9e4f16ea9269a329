"""The draft is kept: whole or not at all, and found again after a crash."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

import pytest
from harness.workspace import ROOT
from operator_panel.teach import draft as teach
from operator_panel.teach import kept_io
from operator_panel.teach.draft import TeachError, draft_of
from operator_panel.teach.history import Edits
from operator_panel.teach.kept_io import Lesson
from scara_config import ConfigError, load_robot

ROBOT = load_robot(ROOT / "config")


def wait_of(seconds: float) -> teach.Draft:
    """Return a draft of one wait."""
    return teach.waiting(teach.empty("TAUGHT", ROBOT), ROBOT, 0, seconds)


def edit(lesson: Lesson, draft: teach.Draft) -> Edits:
    """Let this be the draft."""
    return asyncio.run(lesson.edit(lambda history: history.edited(draft, 1)))


def test_each_edit_is_on_the_disk_before_it_is_shown(tmp_path: Path) -> None:
    """Who starts after a crash finds it; the file is what the robot takes."""
    lesson = Lesson(tmp_path / "drafts", ROBOT)
    edit(lesson, wait_of(0.5))
    again = Lesson(tmp_path / "drafts", ROBOT)
    assert again.draft == lesson.draft
    assert draft_of(lesson.path.read_text(), ROBOT) == lesson.draft
    assert lesson.path.name == "TAUGHT.LS"


def test_edit_that_cannot_be_written_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A full disk: the draft is as before, on the page too."""
    lesson = Lesson(tmp_path, ROBOT)
    edit(lesson, wait_of(0.5))

    def full(path: Path, text: str) -> None:
        raise ConfigError(f"{path}: cannot be written: No space left on device")

    monkeypatch.setattr(kept_io, "replace_file", full)
    with pytest.raises(TeachError, match=r"not kept: .*No space left"):
        edit(lesson, wait_of(0.7))
    assert lesson.draft == wait_of(0.5) == Lesson(tmp_path, ROBOT).draft


def test_newest_of_two_edits_wins_and_none_is_torn(tmp_path: Path) -> None:
    """Two pages at once: each edit is made on what the other has left."""
    lesson = Lesson(tmp_path, ROBOT)

    async def both() -> None:
        def add(seconds: float) -> object:
            def change(history: Edits) -> Edits:
                made = teach.waiting(history.draft, ROBOT, 0, seconds)
                return history.edited(made, 1)

            return lesson.edit(change)

        await asyncio.gather(*(add(0.1 * k) for k in range(1, 11)))  # type: ignore[arg-type]

    asyncio.run(both())
    assert len(lesson.draft.program.lines) == 10
    assert lesson.history.version == 10
    assert Lesson(tmp_path, ROBOT).draft == lesson.draft


def test_draft_of_another_name_is_found_again_and_overwrites_none(tmp_path: Path) -> None:
    """The newest file counts; what had the name before stands beside it."""
    (tmp_path / "MINE.LS").write_text("an older one")
    os.utime(tmp_path / "MINE.LS", (1.0, 1.0))
    (tmp_path / "TAUGHT.LS").write_text(wait_of(0.5).text)
    lesson = Lesson(tmp_path, ROBOT)
    edit(lesson, teach.renamed(lesson.draft, ROBOT, "MINE"))
    assert Lesson(tmp_path, ROBOT).draft.program.name == "MINE"
    assert (tmp_path / "MINE.LS.before").read_text() == "an older one"
    edit(lesson, teach.renamed(lesson.draft, ROBOT, "TAUGHT"))
    (tmp_path / "MINE.LS").write_text("one between")
    edit(lesson, teach.renamed(lesson.draft, ROBOT, "MINE"))
    assert (tmp_path / "MINE.LS.before").read_text() == "an older one"
    assert (tmp_path / "MINE.LS.before_2").read_text() == "one between"


def test_file_that_cannot_be_read_stays_and_its_fault_is_told(tmp_path: Path) -> None:
    """In the reader's words; what is taught now has another name."""
    (tmp_path / "TAUGHT.LS").write_text("torn")
    lesson = Lesson(tmp_path, ROBOT)
    assert "is no program of a teach pendant" in lesson.trouble
    edit(lesson, teach.waiting(lesson.draft, ROBOT, 0, 1.0))
    assert lesson.path.name == "TAUGHT_2.LS"
    assert (tmp_path / "TAUGHT.LS").read_text() == "torn"


def test_import_whose_name_leads_to_another_folder_is_refused(tmp_path: Path) -> None:
    """The name is that of the file: nothing is written beside the drafts."""
    lesson = Lesson(tmp_path / "runs" / "drafts", ROBOT)
    text = wait_of(0.5).text.replace("/PROG  TAUGHT", "/PROG  ../../OUT")
    with pytest.raises(TeachError, match=r"'\.\./\.\./OUT': capitals, digits and underlines"):
        asyncio.run(lesson.edit(lambda history: history.edited(draft_of(text, ROBOT), 0)))
    assert list(tmp_path.iterdir()) == []
