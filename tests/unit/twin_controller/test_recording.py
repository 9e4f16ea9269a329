"""What the recorder keeps and says."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

import pytest
from scara_config import ConfigError, convert
from twin_controller.recording import Level, RecorderFile, RecordingStatus, bag_path, diagnose

GOOD: dict[str, Any] = {
    "recorder": {
        "topics": ["twin/joint_states", "/diagnostics"],
        "write_period_ms": 50.0,
        "queue_messages": 1000,
        "min_free_mb": 1.0,
    },
    "limits": {"of": "another package"},
}


def test_the_recorder_reads_its_own_section_only() -> None:
    """The other sections of experiments.yaml are not its business."""
    assert convert(GOOD, RecorderFile, "experiments.yaml").recorder.topics == ["twin/joint_states", "/diagnostics"]


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("topics", [], r"recorder.topics = \[\].*length >= 1"),
        ("topics", ["no spaces"], "recorder.topics.*no spaces.*regex"),
        ("write_period_ms", 500.0, "recorder.write_period_ms = 500.0: Expected `float` <= 100.0"),
        ("queue_messages", 1, "recorder.queue_messages = 1: Expected `int` >= 100"),
        ("min_free_mb", -1.0, "recorder.min_free_mb = -1.0: Expected `float` >= 0.0"),
        ("compression", "lz4", "unknown field `compression`"),
    ],
)
def test_a_wrong_setting_is_named_with_what_is_allowed(key: str, value: object, text: str) -> None:
    """File, key, value and the allowed range are in the error."""
    wrong = {"recorder": {**GOOD["recorder"], key: value}}
    with pytest.raises(ConfigError, match=text):
        convert(wrong, RecorderFile, "experiments.yaml")


@pytest.mark.parametrize(
    ("status", "level", "message"),
    [
        (RecordingStatus(), Level.OK, "not recording"),
        (RecordingStatus(path="/a.bag", active=True), Level.OK, "recording"),
        (RecordingStatus(active=True, dropped=3), Level.WARN, "messages lost: 3 dropped"),
        (RecordingStatus(dropped=3, refused=1), Level.WARN, "messages lost: 3 dropped, 1 refused"),
        (RecordingStatus(dropped=3, failure="disk full"), Level.ERROR, "recording ended: disk full"),
    ],
)
def test_a_lost_message_is_a_warning_and_a_failure_an_error(status: RecordingStatus, level: Level, message: str) -> None:
    """Nothing is lost silently."""
    found = diagnose(status)
    assert (found.level, found.message) == (level, message)
    assert dict(found.values)["dropped"] == str(status.dropped)


@pytest.mark.parametrize(
    ("requested", "expected"),
    [
        ("", "/home/cell/runs/2030-01-02_03-04-05/run.bag"),
        ("tests/a.bag", "/home/cell/tests/a.bag"),
        ("/data/b.bag", "/data/b.bag"),
    ],
)
def test_a_bag_goes_where_it_was_asked_for(requested: str, expected: str) -> None:
    """An empty path makes a folder of its own per run."""
    assert bag_path(requested, PurePosixPath("/home/cell"), "2030-01-02_03-04-05") == PurePosixPath(expected)


def test_the_shipped_file_loads(request: pytest.FixtureRequest) -> None:
    """The recorder starts with what is in the repository, and keeps what the report needs."""
    from scara_config import load

    path = Path(request.config.rootpath) / "config" / "experiments.yaml"
    topics = load(path, RecorderFile).recorder.topics
    assert {"twin/joint_states", "real/ground_truth", "twin_controller/configuration", "experiment/marker"} <= set(topics)
