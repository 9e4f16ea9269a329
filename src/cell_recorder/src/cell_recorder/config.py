"""Typed content of journal.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import load, locate
from scara_config.quantities import HoldSeconds

Megabytes = Annotated[float, Meta(ge=0.001, le=1e6)]


class JournalSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How much the journal keeps, how soon it is safe, and what counts as an alarm's end."""

    keep_days: Annotated[int, Meta(ge=1, le=36500)]
    limit_mb: Megabytes
    day_limit_mb: Megabytes
    fsync_ms: Annotated[float, Meta(ge=0.0, le=60_000.0)]
    queue_entries: Annotated[int, Meta(ge=10, le=1_000_000)]
    alarm_hold_s: HoldSeconds
    silent_s: Annotated[float, Meta(ge=1.5, le=3600.0)]
    cycle_rest_s: HoldSeconds
    repeat_entries: Annotated[int, Meta(ge=1, le=10_000)]
    repeat_s: Annotated[float, Meta(ge=1.0, le=3600.0)]


def load_journal(directory: Path | str | None = None) -> JournalSettings:
    """Read journal.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("farm/journal.yaml", directory), JournalSettings)
