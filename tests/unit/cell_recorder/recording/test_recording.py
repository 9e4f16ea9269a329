"""What the recorder keeps and says."""

from __future__ import annotations

import json
from pathlib import Path, PurePosixPath
from typing import Any

import pytest
from cell_recorder.recording.recording import (
    RecorderSettings,
    Recording,
    RecordingStatus,
    RunsState,
    diagnose,
    to_remove,
)
from scara_config import ConfigError
from scara_config.loader import load_keys
from scara_ros.diagnosis import Level

GOOD: dict[str, Any] = {
    "recorder": {
        "topics": ["twin/joint_states", "/diagnostics"],
        "write_period_ms": 50.0,
        "queue_messages": 1000,
        "min_free_mb": 1.0,
        "part_mb": 1000.0,
        "part_minutes": 15.0,
        "runs_limit_mb": 1000.0,
    },
    "limits": {"of": "another package"},
}


def read(folder: Path, tree: object) -> RecorderSettings:
    """Return the recorder's part of a file with this content; JSON is YAML too."""
    file = folder / "experiments.yaml"
    file.write_text(json.dumps(tree))
    (settings,) = load_keys(file, {"recorder": RecorderSettings})
    assert isinstance(settings, RecorderSettings)
    return settings


def test_the_recorder_reads_its_own_section_only(tmp_path: Path) -> None:
    """The other sections of experiments.yaml are not its business."""
    assert read(tmp_path, GOOD).topics == ["twin/joint_states", "/diagnostics"]


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("topics", [], r"recorder.topics = \[\].*length >= 1"),
        ("topics", ["no spaces"], "recorder.topics.*no spaces.*regex"),
        ("write_period_ms", 500.0, "recorder.write_period_ms = 500.0: Expected `float` <= 100.0"),
        ("queue_messages", 1, "recorder.queue_messages = 1: Expected `int` >= 100"),
        ("min_free_mb", -1.0, "recorder.min_free_mb = -1.0: Expected `float` >= 0.0"),
        ("part_mb", 0.5, "recorder.part_mb = 0.5: Expected `float` >= 1.0"),
        ("part_minutes", 0.0, "recorder.part_minutes = 0.0: Expected `float` > 0.0"),
        ("runs_limit_mb", 0.0, "recorder.runs_limit_mb = 0.0: Expected `float` >= 1.0"),
        ("compression", "lz4", "unknown field `compression`"),
    ],
)
def test_a_wrong_setting_is_named_with_what_is_allowed(
    tmp_path: Path, key: str, value: object, text: str
) -> None:
    """File, key, value and the allowed range are in the error."""
    wrong = {"recorder": {**GOOD["recorder"], key: value}}
    with pytest.raises(ConfigError, match=text):
        read(tmp_path, wrong)


@pytest.mark.parametrize(
    ("status", "level", "message"),
    [
        (RecordingStatus(), Level.OK, "not recording"),
        (RecordingStatus(path="/a.bag", active=True), Level.OK, "recording"),
        (RecordingStatus(active=True, dropped=3), Level.WARN, "messages lost: 3 dropped"),
        (RecordingStatus(dropped=3, refused=1), Level.WARN, "messages lost: 3 dropped, 1 refused"),
        (
            RecordingStatus(dropped=3, failure="disk full"),
            Level.ERROR,
            "recording ended: disk full",
        ),
    ],
)
def test_a_lost_message_is_a_warning_and_a_failure_an_error(
    status: RecordingStatus, level: Level, message: str
) -> None:
    """Nothing is lost silently."""
    found = diagnose(status, RunsState(), "/recorder")
    assert (found.level, found.message) == (level, message)
    assert found.values["dropped"] == status.dropped


@pytest.mark.parametrize(
    ("runs", "level", "text"),
    [
        (RunsState(900.0, 1000.0, removed=2), Level.OK, "recording"),
        (RunsState(1100.0, 1000.0), Level.WARN, "holds 1100 MB, runs_limit_mb is 1000"),
        (RunsState(900.0, 1000.0, problem="a.bag cannot be removed"), Level.WARN, "a.bag cannot"),
    ],
)
def test_runs_folder_that_stays_too_full_is_a_warning(
    runs: RunsState, level: Level, text: str
) -> None:
    """What was removed is counted beside what is recorded."""
    found = diagnose(RecordingStatus(active=True), runs, "/recorder")
    assert found.level == level and text in found.message
    assert (found.values["runs_mb"], found.values["runs_removed"]) == (runs.held_mb, runs.removed)


def recording(name: str, size: int, age: float) -> Recording:
    """Return a recording that was last written to ``age`` [s] before the time 10,000 s."""
    return Recording(PurePosixPath(name), size, 10_000.0 - age)


@pytest.mark.parametrize(
    ("excess", "expected"),
    [(0.0, []), (-5.0, []), (1.0, ["old"]), (10.0, ["old"]), (11.0, ["old", "middle"])],
)
def test_the_oldest_go_first_and_no_more_than_needed(excess: float, expected: list[str]) -> None:
    """What is within the limit stays."""
    held = [recording("new", 10, 700.0), recording("old", 10, 900.0), recording("middle", 10, 800)]
    assert [each.path.name for each in to_remove(held, excess, 10_000.0)] == expected


def test_what_was_written_to_lately_stays() -> None:
    """It may be the open recording of another cell."""
    assert to_remove([recording("open", 10, 599.0)], 1.0, 10_000.0) == []


def test_the_shipped_file_loads(request: pytest.FixtureRequest) -> None:
    """The recorder starts with what is in the repository, and keeps what the report needs."""
    path = Path(request.config.rootpath) / "config" / "experiments.yaml"
    topics = load_keys(path, {"recorder": RecorderSettings})[0].topics
    assert {
        "twin/joint_states",
        "real/ground_truth",
        "twin_controller/configuration",
        "experiment/marker",
    } <= set(topics)
