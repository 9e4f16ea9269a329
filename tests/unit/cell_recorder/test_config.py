"""The limits of journal.yaml."""

from __future__ import annotations

import pytest
from cell_recorder.config import JournalSettings, load_journal
from harness.yaml_files import CONFIG
from msgspec import ValidationError, convert
from msgspec.structs import asdict

SETTINGS = load_journal(CONFIG)


@pytest.mark.parametrize(
    ("key", "low", "high"),
    [
        ("keep_days", 1, 36_500),
        ("limit_mb", 0.001, 1e6),
        ("day_limit_mb", 0.001, 1e6),
        ("fsync_ms", 0.0, 60_000.0),
        ("queue_entries", 10, 1_000_000),
        ("silent_s", 1.5, 3600.0),
        ("repeat_entries", 1, 10_000),
        ("repeat_s", 1.0, 3600.0),
    ],
)
def test_a_limit_that_keeps_nothing_is_refused(key: str, low: float, high: float) -> None:
    """The least and the largest of journal.yaml are taken, nothing beyond; nor a strange key."""
    fields, step = asdict(SETTINGS), 1 if isinstance(low, int) else 0.0005
    for value in (low, high):
        assert convert({**fields, key: value}, JournalSettings)
    for changed in ({key: low - step}, {key: high + step}, {"strange": 1}):
        with pytest.raises(ValidationError, match=next(iter(changed))):
            convert({**fields, **changed}, JournalSettings)
