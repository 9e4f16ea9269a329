"""The folder in which all recordings lie: what may be written there, and what goes when it is full.

Only recordings that carry the recorder's own mark are ever removed. What a person has put there,
and what was recorded for an experiment, has none.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from glob import escape
from pathlib import Path

from cell_recorder.recording.recording import BAG_NAME, Recording, RunsState, to_remove

MARK_SUFFIX = ".removable"


class BagPathError(ValueError):
    """A recording was asked for at a place where none may be; the text names the allowed folder."""


def bag_file(runs: Path, requested: str, folder: str) -> Path:
    """Return where a recording goes.

    Args:
        runs: The runs folder, resolved.
        requested: Path of a ``.bag``, in or relative to ``runs``. Empty: a folder of its own,
            called ``folder``.
        folder: A name from the time and the cell.

    Raises:
        BagPathError: The path, with all links followed, leads out of the folder, or is no ``.bag``.
    """
    path = runs / requested if requested else runs / folder / BAG_NAME
    allowed = f"recordings go into {runs} only: give a path in it or relative to it"
    if ".." in path.parts or not path.resolve().is_relative_to(runs):
        raise BagPathError(f"{requested}: {allowed}")
    if path.suffix != ".bag":
        raise BagPathError(f"{requested}: must end in .bag; {allowed}")
    return path.resolve()


def parts_of(first: Path) -> list[Path]:
    """List the parts of a recording that exist, in order; the file itself is the first.

    Args:
        first: Path of the recording, as ``recorder/start`` has answered it.
    """
    later = [*first.parent.glob(f"{escape(first.stem)}.part[0-9]*{first.suffix}")]
    numbers = [(path.stem.rpartition(".part")[2], path) for path in later]
    # A copy that somebody has made beside it is none of them.
    numbered = sorted((int(number), path) for number, path in numbers if number.isdecimal())
    return [*([first] if first.exists() else []), *(path for _, path in numbered)]


def mark_of(first: Path) -> Path:
    """Return the file beside a recording that says that it may be removed."""
    return first.with_suffix(MARK_SUFFIX)


def keep_limit(
    runs: Path, state: RunsState, now: float, busy: Path | None = None
) -> tuple[RunsState, list[Recording]]:
    """Remove the oldest recordings of no experiment while the folder is beyond its limit.

    Args:
        runs: The runs folder.
        state: As it was at the last call; its limit and count go on.
        now: System time [s].
        busy: The recording that is being written: it stays.

    Returns:
        The new state, and what was removed.
    """
    removed, problem = [], ""
    try:
        held, marks = _look_at(runs)
        excess = held - state.limit_mb * 1e6
        idle = [] if excess <= 0.0 else [each for each in _recordings(marks) if each.path != busy]
    except OSError as error:  # a disk of the network is away, say: look again later
        return replace(state, problem=f"{error.filename} cannot be read: {error.strerror}"), []
    for recording in to_remove(idle, excess, now):
        first = Path(recording.path)
        try:
            # The mark goes last: without it nothing of a recording is ever removed.
            for path in (*parts_of(first), mark_of(first)):
                path.unlink()
            for folder in first.parents:
                if folder == runs or any(folder.iterdir()):
                    break
                folder.rmdir()
        except OSError as error:
            problem = f"{recording.path} cannot be removed: {error.strerror}"
            continue
        removed.append(recording)
        held -= recording.size
    total = state.removed + len(removed)
    return RunsState(held / 1e6, state.limit_mb, total, problem), removed


def _look_at(runs: Path) -> tuple[int, list[Path]]:
    """Return the size of all files [bytes] and the marks of recordings; follow no link."""
    size, marks = 0, []
    for folder, _, names in os.walk(runs):
        for name in names:
            path = Path(folder, name)
            try:
                size += path.lstat().st_size
            except FileNotFoundError:  # removed meanwhile
                continue
            if name.endswith(MARK_SUFFIX) and not path.is_symlink():
                marks.append(path)
    return size, marks


def _recordings(marks: list[Path]) -> Iterator[Recording]:
    """Yield the recordings that the marks stand beside."""
    for mark in marks:
        first = mark.with_suffix(".bag")
        try:
            stats = [path.lstat() for path in (mark, *parts_of(first))]
        except FileNotFoundError:  # removed meanwhile, or marked by an experiment
            continue
        changed = max(stat.st_mtime for stat in stats)
        yield Recording(first, sum(stat.st_size for stat in stats), changed)
