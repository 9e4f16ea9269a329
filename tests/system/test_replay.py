"""A recording of a live cell is evidence.

It replays without a difference, and shows the pair at any time.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import pytest
from harness.live_cell import LiveCell


def test_a_recorded_run_replays_without_a_difference(live_cell: LiveCell) -> None:
    """Both decisions of a move and of a refusal are made again, bit for bit, from the bag alone."""
    # A new folder each time: the scene may be played again, and nothing is written over.
    bag = Path(tempfile.mkdtemp(dir=live_cell.folder)) / "run.bag"
    started = live_cell.call("/recorder/start", f"{{path: {bag}}}")
    assert started["success"], started
    for point in (
        "{x: 0.55, y: 0.10, z: 0.10, speed_percent: 30}",
        "{x: 0.65, y: 0.0, z: 0.0, speed_percent: 30}",
    ):
        answer = live_cell.call("/move_to", point)
        assert answer["success"], answer
    assert not live_cell.call("/twin_controller/command", "{command: RESUME}")["success"]
    live = live_cell.call("/twin_controller/shadow", "{time: -1.0}")
    assert live["success"], live
    stopped = live_cell.call("/recorder/stop")
    assert stopped["success"], stopped

    said = live_cell.tool("rosrun", "twin_experiments", "replay_decisions", str(bag), timeout=120.0)
    assert ": 0 differences" in said, said
    assert "0 decisions and" not in said, said

    document = json.loads(live["document"])
    shown = live_cell.tool(
        "rosrun", "twin_experiments", "shadow", str(bag), "--time", repr(document["stamp"])
    )
    again = json.loads(shown)
    for side in ("real", "twin"):
        assert again[side].pop("stamp") == pytest.approx(document[side].pop("stamp"), abs=0.05)
    for part in ("authority", "desired", "real", "twin", "names", "decision"):
        assert again[part] == document[part], part


def test_clients_of_other_drivers_find_what_they_know(live_cell: LiveCell) -> None:
    """industrial_msgs/RobotStatus and speed_scaling_factor say that the robot is ready."""
    status = live_cell.tool("rostopic", "echo", "-n", "1", "/robot_status")
    lines = [line.strip() for line in status.splitlines()]
    values = [line for line in lines if line.startswith("val:")]
    assert values == ["val: 2", "val: 0", "val: 1", "val: 1", "val: 0", "val: 0"], (
        "AUTO, not stopped, drives on, possible, still"
    )
    factor = live_cell.tool("rostopic", "echo", "-n", "1", "/speed_scaling_factor")
    assert 0.0 < float(factor.split()[1]) <= 1.0
