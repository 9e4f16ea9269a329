"""The recorder's settings, where a bag goes, and how a recording is judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_ros.diagnosis import Diagnosis, Level

BAG_NAME = "run.bag"
MARKER = "/experiment/marker"
"""A message on this topic, in any namespace, makes a recording an experiment's."""
REST_S = 600.0  # our choice: what was written to since then may be another cell's open recording


class RecorderSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Section ``recorder`` of experiments.yaml."""

    topics: Annotated[
        list[Annotated[str, Meta(pattern=r"^/?[A-Za-z][A-Za-z0-9_/]*\Z")]], Meta(min_length=1)
    ]
    write_period_ms: Annotated[float, Meta(ge=5.0, le=100.0)]
    queue_messages: Annotated[int, Meta(ge=100, le=1_000_000)]
    min_free_mb: Annotated[float, Meta(ge=0.0, le=1e6)]
    part_mb: Annotated[float, Meta(ge=1.0, le=1e6)]
    part_minutes: Annotated[float, Meta(gt=0.0, le=1440.0)]
    runs_limit_mb: Annotated[float, Meta(ge=1.0, le=1e9)]


@dataclass(frozen=True)
class RecordingStatus:
    """Where a recording stands.

    Args:
        path: Of the first part; empty before the first recording.
        active: Messages are being accepted.
        messages: Written, in all parts together.
        size: Bytes written, in all parts together.
        parts: Bags that were begun.
        waiting: Messages accepted but not written yet.
        dropped: Messages lost because the queue was full or the recording had failed.
        refused: Messages that do not fit into the bag: no definition, or another type than before
            on that topic.
        set_back: How often the clock was set back; the stamps went on from where they were.
        failure: Why the recording ended by itself, or empty.
    """

    path: str = ""
    active: bool = False
    messages: int = 0
    size: int = 0
    parts: int = 0
    waiting: int = 0
    dropped: int = 0
    refused: int = 0
    set_back: int = 0
    failure: str = ""


@dataclass(frozen=True)
class Recording:
    """A recording of no experiment that lies in the runs folder.

    Args:
        path: Of its first part.
        size: Of all its parts [bytes].
        changed: When it was written to last [s], system time.
    """

    path: PurePath
    size: int
    changed: float


@dataclass(frozen=True)
class RunsState:
    """What the runs folder holds.

    Args:
        held_mb: Size of everything in it [MB].
        limit_mb: What it should hold at most [MB].
        removed: Recordings that this recorder has removed.
        problem: Why one that should go is still there, or empty.
    """

    held_mb: float = 0.0
    limit_mb: float = 0.0
    removed: int = 0
    problem: str = ""


def to_remove(recordings: Sequence[Recording], excess: float, now: float) -> list[Recording]:
    """Choose what makes room for ``excess`` [bytes]: the oldest first, none that may be in use.

    Args:
        recordings: Those of no experiment.
        excess: How much is too much; nothing goes if it is not positive.
        now: System time [s].
    """
    chosen = []
    for recording in sorted(recordings, key=lambda each: each.changed):
        if excess <= 0.0:
            break
        if now - recording.changed >= REST_S:
            chosen.append(recording)
            excess -= recording.size
    return chosen


def part_path(first: PurePath, number: int) -> PurePath:
    """Return where part ``number`` of a recording goes, counted from 1.

    >>> part_path(PurePath("run.bag"), 1).name, part_path(PurePath("run.bag"), 2).name
    ('run.bag', 'run.part0002.bag')
    """
    return first if number == 1 else first.with_name(f"{first.stem}.part{number:04d}{first.suffix}")


def diagnose(status: RecordingStatus, runs: RunsState, name: str) -> Diagnosis:
    """Judge a recording for the node ``name``, and the runs folder.

    A failure is an ERROR, a lost message a WARN, and so is a runs folder that stays too full.
    """
    lost = [
        f"{count} {word}"
        for count, word in ((status.dropped, "dropped"), (status.refused, "refused"))
        if count
    ]
    if status.failure:
        level, message = Level.ERROR, f"recording ended: {status.failure}"
    elif lost:
        level, message = Level.WARN, f"messages lost: {', '.join(lost)}"
    elif runs.problem:
        level, message = Level.WARN, runs.problem
    elif runs.held_mb > runs.limit_mb > 0.0:
        level = Level.WARN
        message = (
            f"the runs folder holds {runs.held_mb:.0f} MB, runs_limit_mb is {runs.limit_mb:g}, "
            "and nothing in it may be removed: move experiments elsewhere"
        )
    else:
        level, message = Level.OK, "recording" if status.active else "not recording"
    values = {
        "path": status.path,
        "messages": status.messages,
        "size": status.size,
        "parts": status.parts,
        "waiting": status.waiting,
        "dropped": status.dropped,
        "refused": status.refused,
        "clock_set_back": status.set_back,
        "runs_mb": round(runs.held_mb),
        "runs_removed": runs.removed,
    }
    return Diagnosis(level, name, message, values)
