"""What the recorder keeps and says: its settings, where a bag goes, and how a recording is judged."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from pathlib import PurePath
from typing import Annotated

import msgspec
from msgspec import Meta

BAG_NAME = "run.bag"


class RecorderSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Section ``recorder`` of experiments.yaml."""

    topics: Annotated[list[Annotated[str, Meta(pattern=r"^/?[A-Za-z][A-Za-z0-9_/]*$")]], Meta(min_length=1)]
    write_period_ms: Annotated[float, Meta(ge=5.0, le=100.0)]
    queue_messages: Annotated[int, Meta(ge=100, le=1_000_000)]
    min_free_mb: Annotated[float, Meta(ge=0.0, le=1e6)]


class RecorderFile(msgspec.Struct, frozen=True):
    """The part of experiments.yaml that the recorder reads; the other sections belong to twin_experiments."""

    recorder: RecorderSettings


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus (REP-107)."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class RecordingStatus:
    """Where a recording stands.

    Args:
        path: Of the bag; empty before the first recording.
        active: Messages are being accepted.
        messages: Written to the bag.
        size: Bytes written.
        waiting: Messages accepted but not written yet.
        dropped: Messages lost because the queue was full or the recording had failed.
        refused: Messages that do not fit into the bag: no definition, or another type than before on that topic.
        failure: Why the recording ended by itself, or empty.
    """

    path: str = ""
    active: bool = False
    messages: int = 0
    size: int = 0
    waiting: int = 0
    dropped: int = 0
    refused: int = 0
    failure: str = ""


@dataclass(frozen=True)
class Diagnosis:
    """What /diagnostics shows of a recording."""

    level: Level
    message: str
    values: tuple[tuple[str, str], ...]


def diagnose(status: RecordingStatus) -> Diagnosis:
    """Judge a recording: a failure is an ERROR, a lost message a WARN."""
    lost = [f"{count} {word}" for count, word in ((status.dropped, "dropped"), (status.refused, "refused")) if count]
    if status.failure:
        level, message = Level.ERROR, f"recording ended: {status.failure}"
    elif lost:
        level, message = Level.WARN, f"messages lost: {', '.join(lost)}"
    elif status.active:
        level, message = Level.OK, "recording"
    else:
        level, message = Level.OK, "not recording"
    names = ("path", "messages", "size", "waiting", "dropped", "refused")
    return Diagnosis(level, message, tuple((name, str(getattr(status, name))) for name in names))


def bag_path(requested: str, base: PurePath, stamp: str) -> PurePath:
    """Return where a recording goes: as requested (relative to ``base``), or ``runs/<stamp>/run.bag`` below ``base``."""
    return base / requested if requested else base / "runs" / stamp / BAG_NAME
