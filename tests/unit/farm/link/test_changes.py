"""A cell looks at a change itself, keeps it for its next start, and tells who asked."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
from farm.link import changes_io
from farm.link.changes_io import CellChanges
from farm.wire import Answer, Command, Configuration
from harness.yaml_files import CONFIG
from scara_config.profile import copy_in_force
from scara_config.rollout.change import Change
from scara_config.rollout.kept import Kept, apply_change, read_kept, write_kept

CHANGE = Change("settled", {"what_if.yaml": {"uncertainty.table_mm": 0.7}})


class Cell:
    """A cell's changes, what its doctor says, and what the audit was told."""

    def __init__(self, folder: Path, config: Path = CONFIG) -> None:
        """Begin without any."""
        self.file = folder / "configuration" / "cell" / "kept.json"
        self.said: list[str] = []
        self.told: list[tuple[str, bool]] = []
        self.changes = CellChanges(self.file, config, lambda _: self.said, self._tell)

    def _tell(self, command: Command, answer: Answer) -> None:
        self.told.append((command.command, answer.accepted))

    def ask(self, word: str, change: Change | None = CHANGE, number: int | None = None) -> Answer:
        """Ask for something, based on what is kept now unless a number is given."""
        revision = self.changes.number if number is None else number
        asked = Command("1", word, "ann", "desk", 0.0, revision=revision, change=change)
        return self.changes.obey(asked)


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    """A cell with its own files."""
    return Cell(tmp_path)


def test_an_examined_change_is_not_kept(cell: Cell) -> None:
    """A look changes nothing; the audit knows of it all the same."""
    assert cell.ask("EXAMINE") == Answer(True, f"{CHANGE.text}: nothing is wrong with it here")
    assert (cell.changes.number, cell.file.exists()) == (0, False)
    assert cell.told == [("EXAMINE", True)]


def test_a_change_is_kept_for_the_next_start_and_taken_back(cell: Cell) -> None:
    """What runs stays what it was."""
    assert cell.ask("CONFIGURE").accepted
    kept = read_kept(cell.file)
    assert (kept.wanted, kept.by, kept.proven) == (CHANGE, "ann@desk", False)
    assert cell.changes.shown() == Configuration(1, "", CHANGE.text, "", False)
    assert cell.ask("TAKE_BACK").text == "from the next start on: the cell's own files"
    assert cell.changes.shown() == Configuration(2)


def test_only_the_named_change_is_taken_back_however_often_it_is_said(cell: Cell) -> None:
    """What was proven before stays, also at a cell that never had the one that is taken back."""
    late = Change("late", {"what_if.yaml": {"uncertainty.table_mm": 0.9}})
    none = f"has the cell's own files, not {late.text}: nothing was changed"
    assert cell.ask("TAKE_BACK", late) == Answer(True, none)
    assert not cell.file.exists()
    assert cell.ask("CONFIGURE").accepted
    write_kept(cell.file, read_kept(cell.file).start().ready())
    proven = cell.changes.shown()
    other = Answer(True, f"has {CHANGE.text}, not {late.text}: nothing was changed")
    assert (cell.ask("TAKE_BACK", late), cell.changes.shown()) == (other, proven)
    assert cell.ask("CONFIGURE", late).accepted
    assert cell.ask("TAKE_BACK", late).text == f"from the next start on: {CHANGE.text}"
    assert cell.ask("TAKE_BACK", late) == other
    assert read_kept(cell.file).wanted == CHANGE


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"farm/farm.yaml": {"link.remote_at_start": True}}, "no change from elsewhere may touch"),
        ({"what_if.yaml": {"uncertainty.table_mm": -1}}, "uncertainty.table_mm"),
        ({"what_if.yaml": {"uncertainty.tabel_mm": 1}}, "tabel_mm"),
    ],
)
def test_a_wrong_change_is_refused_with_the_reason(cell: Cell, values: dict, said: str) -> None:
    """Whatever the desk has looked at: the cell looks itself."""
    answer = cell.ask("CONFIGURE", Change("x", values))
    assert not answer.accepted and said in answer.text
    assert not cell.file.exists()


def test_a_full_disk_is_an_answer_and_the_audit_knows_of_it(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The desk would else wait in vain, and nobody would know that it had asked."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(changes_io, "faults_of", full)
    answer = cell.ask("CONFIGURE")
    assert answer == Answer(False, "the change cannot be tried here: No space left on device")
    assert cell.told == [("CONFIGURE", False)]


def test_what_the_doctor_finds_is_the_answer(cell: Cell) -> None:
    """Files that are right by themselves may not fit each other."""
    cell.said = ["wrong joint_1: no loop"]
    assert cell.ask("CONFIGURE") == Answer(False, "wrong joint_1: no loop")
    assert cell.told == [("CONFIGURE", False)]


def test_who_was_slower_is_refused(cell: Cell) -> None:
    """Two desks that decide by the same picture: one of them."""
    assert cell.ask("CONFIGURE", number=0).accepted
    late = cell.ask("TAKE_BACK", number=0)
    assert late == Answer(False, "somebody else has decided meanwhile: look again")
    assert read_kept(cell.file).wanted == CHANGE


def test_a_change_is_looked_at_with_the_cells_own_files(tmp_path: Path) -> None:
    """The next change does not stand on the one that runs."""
    copy_in_force(CONFIG, tmp_path / "copy")
    apply_change(CHANGE, CONFIG, tmp_path / "copy")
    (tmp_path / "copy" / "motion.yaml").unlink()
    cell = Cell(tmp_path, tmp_path / "copy")
    assert cell.changes.shown().running == CHANGE.text
    assert cell.ask("EXAMINE", Change("y", {"what_if.yaml": {"uncertainty.part_mm": 0.2}})).accepted


def test_what_cannot_be_read_is_said_and_nothing_is_taken(cell: Cell) -> None:
    """A file that somebody has broken by hand."""
    cell.file.parent.mkdir(parents=True)
    cell.file.write_text("no JSON")
    assert cell.changes.number == -1
    assert "cannot be read" in cell.changes.shown().note
    assert not cell.ask("CONFIGURE").accepted
    assert cell.file.read_text() == "no JSON"


def test_nothing_is_taken_without_a_change(cell: Cell) -> None:
    """An empty question; the desk of an earlier version names none that it takes back."""
    for word in ("CONFIGURE", "TAKE_BACK"):
        assert cell.ask(word, None) == Answer(False, f"{word}: names no change")
    assert read_kept(cell.file) == Kept()
