"""Starting and ending a cell: nothing is left behind, and every fault is named."""

from __future__ import annotations

import json
import os
import re
import signal
from pathlib import Path

import pytest
from harness.live_cell import NODES, LiveCell
from harness.processes import Process, free_port, wait_until
from harness.yaml_files import changed_yaml, copy_configuration, shipped
from scara_bringup.status.running_io import index

pytestmark = pytest.mark.system

# Leaves only the nodes that a pair needs to be ready. How a cell ends does not depend on the
# others, and each takes a second of processor time to start.
SMALL = tuple(
    word
    for node in (
        "kinematics_server",
        "joint_vel_controller",
        "motion_server",
        "trajectory_server",
    )
    for word in ("--without", node)
)


def pid_of(bringup: Process, node: str) -> int:
    """Read a node's process id from what the bring-up says to ``./cell status``."""
    cell = json.loads((index() / f"{bringup.pid}.json").read_text())
    (found,) = (one["pid"] for one in cell["nodes"] if one["name"] == node)
    return int(found)


def node_runs_as(pid: int, node: str) -> bool:
    """Return whether a process is a node's own program, not a launcher of it."""
    words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
    return any(word.endswith(b"/" + node.encode()) for word in words[:2])


def config_with(folder: Path, file: str, path: list[str | int], value: object) -> dict[str, str]:
    """Return the environment of a copy of the configuration with one value changed."""
    changed_yaml(shipped(file), copy_configuration(folder), path, value)
    return {"SCARA_CONFIG_DIR": str(folder)}


@pytest.mark.parametrize(
    ("number", "without"),
    [
        (signal.SIGINT, ()),
        pytest.param(signal.SIGTERM, SMALL, marks=pytest.mark.thorough),
        pytest.param(signal.SIGHUP, SMALL, marks=pytest.mark.thorough),
    ],
    ids=["SIGINT", "SIGTERM", "SIGHUP"],
)
def test_signal_ends_the_cell_in_order_and_leaves_no_process(
    cell: LiveCell, number: signal.Signals, without: tuple[str, ...]
) -> None:
    """Ctrl-C, a polite kill and a closed terminal: the exit code tells which.

    Nothing needed a harder signal. The table showed the nodes themselves: rosrun replaces itself
    by the node, so a signal to the shown process reaches it.
    """
    bringup = cell.start("up", *without)
    cell.wait_ready(bringup)
    for node in NODES:
        if node not in without:
            assert node_runs_as(pid_of(bringup, node), node)
    os.kill(bringup.pid, number)
    assert bringup.wait(25.0) == 128 + number
    wait_until(lambda: not cell.stage.left_over(), 3.0, "the end of all processes")
    assert f"{number.name}: ending the cell" in bringup.output
    assert "still there" not in bringup.output, bringup.output


def test_signal_while_starting_leaves_no_process(cell: LiveCell) -> None:
    """Impatience does no harm."""
    bringup = cell.start()
    wait_until(lambda: "starting" in bringup.output, 30.0)
    os.kill(bringup.pid, signal.SIGINT)
    assert bringup.wait(25.0) != 0
    wait_until(lambda: not cell.stage.left_over(), 3.0, "the end of all processes")


def test_killed_bring_up_leaves_no_process(cell: LiveCell) -> None:
    """SIGKILL gives it no chance to end anything; the kernel does."""
    bringup = cell.start("up", *SMALL)
    cell.wait_ready(bringup)
    os.kill(bringup.pid, signal.SIGKILL)
    bringup.wait()
    wait_until(lambda: not cell.stage.left_over(), 30.0, "the end of all processes")


def test_node_that_dies_is_named_and_ends_the_cell_with_its_error(cell: LiveCell) -> None:
    """The exit code is the node's, its last lines are shown, nothing stays."""
    node = "simulator"
    bringup = cell.start("up", *SMALL)
    cell.wait_ready(bringup)
    os.kill(pid_of(bringup, node), signal.SIGKILL)
    assert bringup.wait(25.0) == 128 + signal.SIGKILL
    assert f"node {node} was killed by SIGKILL" in bringup.output
    assert f"the last lines of {cell.output}/log/{node}.log" in bringup.output
    wait_until(lambda: not cell.stage.left_over(), 3.0, "the end of all processes")


def test_node_with_a_wrong_configuration_is_named_with_its_fatal_line(cell: LiveCell) -> None:
    """File, key, value and what is allowed reach the terminal; the exit code is 2."""
    env = config_with(cell.folder / "wrong", "robot.yaml", ["joints", 0, "velocity_deg_s"], -1.0)
    bringup = cell.start(env=env)
    assert bringup.wait(60.0) == 2, bringup.output
    assert re.search(
        r"robot\.yaml: joints\[0\]\.velocity_deg_s = -1\.0: Expected `float` >= 5\.0",
        bringup.output,
    )


def test_wrong_configuration_of_the_bring_up_ends_it_before_it_starts_anything(
    cell: LiveCell,
) -> None:
    """One line, exit code 2."""
    bringup = cell.start(
        env=config_with(cell.folder / "wrong", "bringup.yaml", ["ready_timeout"], "long")
    )
    assert bringup.wait(20.0) == 2
    assert re.search(r"bringup\.yaml: ready_timeout = 'long': Expected `float`", bringup.output)
    assert "starting" not in bringup.output


def test_cell_that_does_not_get_ready_says_what_is_missing(cell: LiveCell) -> None:
    """Without a robot the twin controller stays OFFLINE; it and its reason are named."""
    bringup = cell.start(
        "up",
        "--without",
        "emulator",
        *SMALL,
        env=config_with(cell.folder / "c", "bringup.yaml", ["ready_timeout"], 10.0),
    )
    assert bringup.wait(60.0) == 1
    assert "not ready after 10 s; missing:" in bringup.output
    assert re.search(r"twin_controller: mode IDLE: it is OFFLINE \(.+\)", bringup.output), (
        bringup.output
    )


def test_twin_by_itself_gets_ready_and_moves(cell: LiveCell) -> None:
    """Without a robot nothing waits for one, and nothing is said of what is not there."""
    bringup = cell.start("up", "--twin-only", *SMALL[2:4], *SMALL[6:])
    cell.wait_ready(bringup)
    assert "pendant" not in bringup.output and "twin_controller" not in bringup.output
    moved = cell.tool_call("move_to", "{x: 0.51, y: 0.16, z: 0.10}")
    assert moved["success"], moved
    bringup.signal(signal.SIGINT)
    assert bringup.wait(30.0) == 128 + signal.SIGINT


def test_master_of_another_machine_is_not_started_here(cell: LiveCell) -> None:
    """ROS_MASTER_URI points elsewhere and nobody answers: the sentence says so."""
    cell.master_port = None
    bringup = cell.start(env={"ROS_MASTER_URI": f"http://192.0.2.1:{free_port()}"})
    assert bringup.wait(20.0) == 1
    assert "another machine: start roscore there" in bringup.output
