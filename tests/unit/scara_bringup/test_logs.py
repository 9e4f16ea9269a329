"""Logs that cannot fill a disk."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from harness.processes import wait_until
from scara_bringup.plan import NodePlan
from scara_bringup.processes.log_file_io import LogFile, cut_off
from scara_bringup.processes.processes_io import Processes


def test_collected_log_keeps_one_older_file(tmp_path: Path) -> None:
    """Ten times the limit is written, twice the limit stays, the newest line among it."""
    log = LogFile(tmp_path / "new" / "rosout.log", 0.1)
    for i in range(10_000):
        log.write(f"{i:09d} " + "x" * 90)
    files = sorted((tmp_path / "new").iterdir())
    assert [file.name for file in files] == ["rosout.log", "rosout.log.1"]
    assert all(file.stat().st_size <= 100_000 for file in files)
    assert files[0].read_text().splitlines()[-1].startswith("000009999 ")


def test_collected_log_on_a_full_disk_costs_lines_only(tmp_path: Path) -> None:
    """The collector goes on."""
    (tmp_path / "rosout.log").symlink_to("/dev/full")
    LogFile(tmp_path / "rosout.log", 0.1).write("lost")


def test_output_of_a_node_is_cut_while_it_writes(tmp_path: Path) -> None:
    """What came before is in the older file, what comes later in the file itself."""
    shout = "printf '%0200000d\\n' 1; read -r _ < go; echo later; sleep 60"
    os.mkfifo(tmp_path / "go")
    with Processes(tmp_path / "log", os.environ) as processes:
        node = NodePlan("loud", "", "bash", ("-c", f"cd {tmp_path}; {shout}"))
        processes.start(node)
        log = processes.log_of("loud")
        wait_until(lambda: log.stat().st_size > 200_000, 10.0, "the first words")
        assert processes.limit_logs(0.1) == [log]
        assert processes.limit_logs(0.1) == []
        assert log.stat().st_size == 0
        assert (tmp_path / "log" / "loud.log.1").stat().st_size == 200_001
        (tmp_path / "go").write_text("go\n")
        wait_until(lambda: log.read_text() == "later\n", 10.0, "the later words")


def test_disk_that_holds_no_older_file_is_freed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The limit holds all the same, and no half copy takes the room."""

    def copy_half(_: Path, target: Path) -> None:
        target.write_text("half")
        raise OSError(28, "No space left on device")

    log = tmp_path / "node.log"
    log.write_bytes(b"x" * 200_000)
    monkeypatch.setattr(shutil, "copyfile", copy_half)
    assert cut_off(log, 0.1)
    assert [(file.name, file.stat().st_size) for file in tmp_path.iterdir()] == [("node.log", 0)]
