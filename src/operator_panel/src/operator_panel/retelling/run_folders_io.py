"""The folder of recorded runs on the disk: what is listed, shown, renamed and deleted."""

from __future__ import annotations

import contextlib
import json
import shutil
import time
from datetime import datetime
from pathlib import Path

from scara_ros.shell.program_io import link_latest

from operator_panel.retelling.bag_length_io import BagLengthError, bag_times
from operator_panel.runs import (
    LATEST,
    Run,
    is_run_name,
    length_text,
    may_be_shown,
    missing,
    part_number,
    size_text,
    verdict,
)

REPORT = "report.html"
LISTED = 50
BUSY_S = (
    5.0  # our choice: the recorder writes each 50 ms; a bag that is still longer unchanged ended
)


class RunFolderError(Exception):
    """A run cannot be renamed, deleted or reported; the text says why and what to do."""


def list_runs(folder: Path) -> list[Run]:
    """Return the newest runs, newest first; an empty list if there is no folder."""
    try:
        found = [
            entry
            for entry in folder.iterdir()
            if entry.is_dir() and not entry.is_symlink() and is_run_name(entry.name)
        ]
        dated = sorted(((entry.stat().st_mtime, entry) for entry in found), reverse=True)[:LISTED]
    except OSError:
        return []
    return [_run(entry, when) for when, entry in dated]


def file_of(folder: Path, run: str, file: str) -> Path | None:
    """Return the path of a file that may be shown, None if there is none or it may not be."""
    path = folder / run / file
    return path if may_be_shown(run, file) and path.is_file() and not path.is_symlink() else None


def bag_of(folder: Path, run: str) -> Path:
    """Return the bag of a run, the first part of several.

    Raises:
        RunFolderError: There is no such run, it has no bag, or it is being recorded.
    """
    return _bags(_idle_run(folder, run))[0]


def rename_run(folder: Path, run: str, name: str) -> None:
    """Give a run another name.

    Raises:
        RunFolderError: It is not there, is being recorded, or the name is taken or is none.
    """
    source, target = _idle_run(folder, run), folder / name
    if not is_run_name(name):
        raise RunFolderError(
            f"{name!r} cannot be a name: letters, digits, point, dash and underline"
        )
    if target.is_symlink() or target.exists():
        raise RunFolderError(f"{name} exists already: choose another name")
    is_latest = _is_latest(folder, source)
    try:
        source.rename(target)
    except OSError as error:
        raise RunFolderError(f"{run} cannot be renamed: {error.strerror}") from error
    if is_latest:
        link_latest(target)


def delete_run(folder: Path, run: str) -> None:
    """Delete a run with everything in it.

    Raises:
        RunFolderError: It is not there, is being recorded, or a file of it cannot be deleted.
    """
    source = _idle_run(folder, run)
    # The link goes first, so that a deletion that fails half-way leaves none to a broken run.
    if _is_latest(folder, source):
        (folder / LATEST).unlink(missing_ok=True)
    try:
        shutil.rmtree(source)
    except OSError as error:
        raise RunFolderError(f"{run} cannot be deleted completely: {error.strerror}") from error


def _idle_run(folder: Path, run: str) -> Path:
    """Return the folder of a run that may be changed."""
    source = folder / run
    if not is_run_name(run) or source.is_symlink() or not source.is_dir():
        raise RunFolderError(f"there is no recording {run!r}: the list is read again")
    if not _bags(source):
        raise RunFolderError(f"{run} holds no bag: it is no recording")
    if _is_busy(source):
        raise RunFolderError(f"{run} is being recorded: press Stop first")
    return source


def _bags(run: Path) -> list[Path]:
    found = [bag for bag in run.glob("*.bag") if bag.is_file() and not bag.is_symlink()]
    return sorted(found, key=lambda bag: (part_number(bag.name), bag.name))


def _is_busy(run: Path) -> bool:
    """Return whether a bag of a run is open and grows."""
    for bag in _bags(run):
        try:
            # A killed recorder leaves a bag without an index too, but that one grows no more.
            if time.time() - bag.stat().st_mtime < BUSY_S and bag_times(bag) is None:
                return True
        except (OSError, BagLengthError):
            continue  # a bag that cannot be read is not being written
    return False


def _is_latest(folder: Path, run: Path) -> bool:
    link = folder / LATEST
    return link.is_symlink() and link.resolve() == run.resolve()


def _run(folder: Path, when: float) -> Run:
    bags = _bags(folder)
    size = sum(bag.stat().st_size for bag in bags if bag.exists())
    has_report = (folder / REPORT).is_file()
    clock = datetime.fromtimestamp(when).strftime("%Y-%m-%d %H:%M")
    busy = _is_busy(folder)
    judged = gone = ""
    if has_report:
        with contextlib.suppress(OSError, ValueError, AttributeError):  # no good report.json
            report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
            judged, gone = verdict(report), missing(report)
    return Run(
        folder.name,
        clock,
        size_text(size) if size else "no bag",
        judged,
        has_report,
        "being recorded" if busy else _length(bags),
        tuple(bag.name for bag in bags),
        busy,
        gone,
    )


def _length(bags: list[Path]) -> str:
    """Return the length of all parts together as text."""
    if not bags:
        return ""
    try:
        found = [bag_times(bag) for bag in bags]
    except (OSError, BagLengthError):
        return "damaged"
    times = [each for each in found if each is not None]
    if len(times) < len(found):
        return "not finished"
    return length_text(max(end for _, end in times) - min(start for start, _ in times))
