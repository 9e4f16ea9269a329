"""A full disk costs log lines, never a node."""

from __future__ import annotations

import io
import logging
import os
import subprocess
import sys
from logging.handlers import RotatingFileHandler
from pathlib import Path

import pytest
from scara_ros.diagnosis import Level
from scara_ros.diagnostics_node import log_diagnosis
from scara_ros.starting.full_disk_io import DroppingStream, Loss, LossCounter, limit_log_file

NODE = """
import logging, os, sys
{prepare}
from rosgraph.roslogging import configure_logging
configure_logging("rospy", filename="node.log")
log = logging.getLogger("rosout")
for i in range(3):
    log.error("the mode has changed")
print("and a word on the screen", flush=True)
print(sys.exc_info(), file=sys.stderr)
from scara_ros.starting.full_disk_io import lost_lines
with open({report!r}, "w") as file:
    file.write(f"{{lost_lines.loss.lines}} {{lost_lines.loss.reason}}")
"""
PREPARE = "from scara_ros.starting.full_disk_io import outlive_full_disk; outlive_full_disk()"


def run_on_full_disk(folder: Path, prepare: str) -> subprocess.CompletedProcess[bytes]:
    """Run a process that logs as a node does, its screen and its log file on a full device."""
    (folder / "node.log").symlink_to("/dev/full")
    script = NODE.format(prepare=prepare, report=str(folder / "report"))
    env = {**os.environ, "ROS_LOG_DIR": str(folder), "PYTHONUNBUFFERED": "1"}
    with open("/dev/full", "wb") as full:
        return subprocess.run(
            [sys.executable, "-c", script], stdout=full, stderr=full, env=env, timeout=60.0
        )


def test_a_node_on_a_full_log_disk_lives_on_and_counts(tmp_path: Path) -> None:
    """Screen and file both answer ENOSPC; each lost line is counted, none is raised."""
    assert run_on_full_disk(tmp_path, PREPARE).returncode == 0
    lines, _, reason = (tmp_path / "report").read_text().partition(" ")
    assert (int(lines) >= 8, reason) == (True, "No space left on device")


def test_a_node_that_is_not_prepared_dies_of_its_first_line(tmp_path: Path) -> None:
    """What the test above protects from is real."""
    assert run_on_full_disk(tmp_path, "").returncode != 0
    assert not (tmp_path / "report").exists()


class Disk(io.StringIO):
    """A stream whose disk is full at times."""

    error: OSError | None = None

    def write(self, text: str) -> int:
        """Write, or raise what the test has set."""
        if self.error is not None:
            raise self.error
        return super().write(text)


def test_a_nodes_log_file_is_limited(tmp_path: Path) -> None:
    """Alone rospy would write 250 MB for each node."""
    handler = RotatingFileHandler(tmp_path / "node.log", maxBytes=50_000_000, backupCount=4)
    logging.getLogger().addHandler(handler)
    try:
        limit_log_file()
    finally:
        logging.getLogger().removeHandler(handler)
        handler.close()
    assert handler.maxBytes * (handler.backupCount + 1) == 20_000_000


def test_the_first_line_after_the_gap_says_how_many_are_missing() -> None:
    """Whoever reads the log sees the gap and why."""
    disk, counter = Disk(), LossCounter()
    stream = DroppingStream(disk, counter)
    stream.write("one\n")
    disk.error = OSError(28, "No space left on device")
    stream.writelines(["two\n", "three\n"])
    disk.error = None
    stream.write("four\n")
    stream.write("five\n")
    gap = "[2 lines are missing here: the disk was full]"
    assert disk.getvalue().splitlines() == ["one", gap, "four", "five"]
    assert (counter.loss.lines, counter.loss.reason) == (2, "No space left on device")


def test_another_error_is_raised_as_before() -> None:
    """A closed pipe is no full disk."""
    disk, counter = Disk(), LossCounter()
    disk.error = BrokenPipeError(32, "Broken pipe")
    with pytest.raises(BrokenPipeError):
        DroppingStream(disk, counter).write("text")
    assert counter.loss.lines == 0


@pytest.mark.parametrize(
    ("loss", "level", "message"),
    [
        (Loss(3, "disk full", 5.0), Level.WARN, "3 log lines lost: disk full"),
        (Loss(3, "disk full", 500.0), Level.OK, "3 log lines lost: disk full"),
    ],
)
def test_lost_lines_are_a_warning_for_a_minute(loss: Loss, level: Level, message: str) -> None:
    """The count stays for good, the warning ends when the disk takes lines again."""
    found = log_diagnosis(loss, "/recorder")
    assert found is not None
    assert (found.level, found.name, found.message) == (level, "/recorder/log", message)


def test_a_complete_log_says_nothing() -> None:
    """No status more than before on a machine in order."""
    assert log_diagnosis(Loss(), "/recorder") is None
