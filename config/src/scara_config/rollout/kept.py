"""What a cell keeps of changes that came from elsewhere; a change holds from its next start on.

A change that the cell does not get ready with is left by itself at the start after that.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec
from msgspec.structs import replace

from scara_config.loader import ConfigError
from scara_config.profile import chosen_robot, copy_in_force, files_in_force
from scara_config.readers import check_files
from scara_config.rollout.change import Change
from scara_config.writer import changed_text, replace_file

FOLDER, FILE, RUNNING = "configuration", "kept.json", "running_change.json"


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Changes of one cell.

    Attributes:
        number: Counts what was decided; a question that is based on another number is refused.
        wanted: Holds from the next start on; None: the files as they are.
        before: Held before; taking back leads there.
        by: Who has decided last, PERSON@DESK.
        begun: A start with it has begun.
        proven: The cell has got ready with it, or without any.
        note: Why the cell has left a change by itself; or empty.
        robot: Whose files they change; empty: whichever the cell has, in a file of before.
    """

    number: int = 0
    wanted: Change | None = None
    before: Change | None = None
    by: str = ""
    begun: bool = False
    proven: bool = True
    note: str = ""
    robot: str = ""

    def offered(self, change: Change, by: str) -> Kept:
        """Return it with a new change; one that was never proven is forgotten."""
        before = self.wanted if self.proven else self.before
        return Kept(self.number + 1, change, before, by, proven=False, robot=chosen_robot())

    def taken_back(self, by: str, note: str = "") -> Kept:
        """Return it with what held before."""
        return Kept(self.number + 1, self.before, by=by, note=note, robot=self.robot)

    def start(self) -> Kept:
        """Return it as a start begins with it: a change is tried once, then it must be proven."""
        if self.proven:
            return self
        if self.begun:
            return self._left("the cell did not get ready with it")
        return replace(self, begun=True)

    def unfit(self, fault: str) -> Kept:
        """Return it without a change that no longer fits the cell's files."""
        return self._left(fault)

    def ready(self) -> Kept:
        """Return it after the cell has got ready."""
        return replace(self, proven=True)

    def _left(self, why: str) -> Kept:
        left = self.wanted.text if self.wanted is not None else "a change"
        return self.taken_back(self.by, f"left {left} by itself: {why}")


def kept_file(runs: Path, cell: str) -> Path:
    """Return where a cell keeps its changes.

    Args:
        runs: Its runs folder.
        cell: Its namespace without slashes at the ends, or ``cell``.
    """
    return runs / FOLDER / cell / FILE


def read_kept(file: Path) -> Kept:
    """Return what is kept for the chosen robot; nothing if there is no file.

    The cell's name says nothing of its robot: of another one's change only the note tells.

    Raises:
        ConfigError: It cannot be read.
    """
    try:
        kept = msgspec.json.decode(file.read_bytes(), type=Kept)
    except FileNotFoundError:
        return Kept()
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file}: cannot be read: {error}; remove it to begin anew") from error
    here = chosen_robot()
    if kept.wanted is None or kept.robot in ("", here):
        return kept
    waits = f"{kept.wanted.text} is for {kept.robot}, this cell has {here}: it waits for its robot"
    return Kept(kept.number, note=waits)


def write_kept(file: Path, kept: Kept) -> None:
    """Keep it: whole on the disk, or as it was.

    Raises:
        ConfigError: It cannot be written.
    """
    with contextlib.suppress(OSError):  # the next line says it
        file.parent.mkdir(parents=True, exist_ok=True)
    if not file.parent.is_dir():
        raise ConfigError(f"{file.parent}: cannot be made")
    replace_file(file, msgspec.json.encode(kept).decode() + "\n")


class Running(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The change that a cell runs with.

    Attributes:
        change: Which.
        base: Folder of the files that it was applied to.
    """

    change: Change
    base: str


def apply_change(change: Change, base: Path, folder: Path) -> None:
    """Write a change into a flat copy of the configuration, and which one it is beside it.

    Args:
        change: What becomes what.
        base: Folder that was copied.
        folder: The copy (:func:`scara_config.profile.copy_in_force`).

    Raises:
        ConfigError: A file or a key is not there; the copy is not to be used then.
    """
    there = files_in_force(folder)
    for file, values in change.by_file().items():
        # Names come from elsewhere: one that leads out of the folder is no file of the copy.
        if file not in there:
            raise ConfigError(f"{file}: this cell has no such file")
        replace_file(folder / file, changed_text(folder / file, values))
    # Beside the files: whoever runs with the copy can tell which change is in it.
    told = msgspec.json.encode(Running(change, str(base))).decode()
    replace_file(folder / RUNNING, told + "\n")


def running_change(folder: Path) -> Running | None:
    """Return the change that a cell's configuration was made with; None: with none.

    Raises:
        ConfigError: It cannot be read.
    """
    file = folder / RUNNING
    try:
        return msgspec.json.decode(file.read_bytes(), type=Running)
    except FileNotFoundError:
        return None
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file}: cannot be read: {error}") from error


@contextlib.contextmanager
def changed_copy(change: Change, base: Path) -> Iterator[Path]:
    """Give a copy of the configuration with a change in it, for whoever judges it.

    Raises:
        ConfigError: A file or a key is not there.
    """
    with tempfile.TemporaryDirectory(prefix="change_") as folder:
        copy_in_force(base, Path(folder))
        apply_change(change, base, Path(folder))
        yield Path(folder)


def faults_of(change: Change, base: Path) -> list[str]:
    """Return what is wrong with a cell's files once they are changed, a line each.

    A change that may not come from elsewhere is wrong before that. A change that is kept already is
    judged by the rule as it is now, too.
    """
    if faults := list(change.faults()):
        return faults
    try:
        with changed_copy(change, base) as folder:
            # The folder is gone when somebody reads this: the files' names are what helps.
            return [line.replace(f"{folder}/", "") for line in check_files(folder)]
    except ConfigError as error:
        return str(error).splitlines()
