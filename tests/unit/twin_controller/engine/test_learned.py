"""What was learned of a robot is there again at the next start, or is said not to be used."""

from __future__ import annotations

import logging
from pathlib import Path

import msgspec
import pytest
from harness.pair import SETUP, idle_pair
from twin_controller.core.follow.response import assumed
from twin_controller.engine.learned_io import (
    Learned,
    learned,
    learned_file,
    read_learned,
    write_learned,
)

replace = msgspec.structs.replace
NAMES = SETUP.names


def known() -> Learned:
    """Return what a controller has learned whose robot has followed."""
    pair = idle_pair()
    response = replace(assumed(SETUP.config.response, NAMES), at=3.0, pace=72.0, spread=0.004)
    follow = replace(pair.state.follow, response=response)
    kept = learned(replace(pair.state, follow=follow), NAMES)
    assert kept is not None
    return kept


def test_what_was_learned_is_read_again(tmp_path: Path) -> None:
    """By joint, in a file for its owner alone; a robot at another address is another one."""
    path = learned_file(tmp_path / "new", "scara", "10.0.0.5", 502)
    assert path != learned_file(tmp_path / "new", "scara", "10.0.0.6", 502)
    write_learned(path, known())
    assert path.stat().st_mode & 0o077 == 0
    event = read_learned(path, NAMES, 7.0)
    assert event is not None and (event.now, event.pace, event.spread) == (7.0, 72.0, 0.004)
    assert event.delay == assumed(SETUP.config.response, NAMES).delay


def test_nothing_is_kept_of_a_robot_that_never_followed() -> None:
    """What is assumed is not learned."""
    assert learned(idle_pair().state, NAMES) is None


@pytest.mark.parametrize(
    "text", ["", "{}", '{"delay_s": "x"}', b"\xff".decode("latin-1"), "joints", "late"]
)
def test_a_file_that_does_not_fit_is_said_and_not_used(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, text: str
) -> None:
    """A robot with other joints, a delay of a minute, half a file."""
    path = tmp_path / "robot.json"
    tree = msgspec.to_builtins(known())
    if text == "joints":
        tree["delay_s"]["joint_9"] = 0.1
    elif text == "late":
        tree["delay_s"][NAMES[0]] = 60.0
    made = msgspec.json.encode(tree) if text in ("joints", "late") else text.encode("latin-1")
    path.write_bytes(made)
    with caplog.at_level(logging.WARNING):
        assert read_learned(path, NAMES, 0.0) is None
    assert "measured anew" in caplog.text and str(path) in caplog.text
    assert read_learned(tmp_path / "none.json", NAMES, 0.0) is None


def test_a_folder_that_cannot_be_written_stops_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It is said."""
    (tmp_path / "file").write_text("")
    with caplog.at_level(logging.WARNING):
        write_learned(tmp_path / "file" / "robot.json", known())
    assert "is not kept" in caplog.text
