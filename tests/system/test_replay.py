"""A recording of a live cell is evidence.

It replays without a difference, and shows the pair at any time.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from cell_recorder.reading.bag_reader_io import open_bag
from harness.live_cell import LiveCell
from harness.wires.service_line import ServiceLine
from twin_analysis.replay.decision_reader_io import read_inputs, read_setups
from twin_analysis.replay.history import shadow_at

ANSWER_S = 10.0
COMPARED = 12
"""So many documents are compared, spread over the second move and the time after it."""


def test_a_recorded_run_replays_without_a_difference(live_cell: LiveCell) -> None:
    """Both decisions of a move and of a refusal are made again, bit for bit, from the bag alone."""
    live_cell.make_ready()
    bag = live_cell.folder / "replayed.bag"
    with _recording(live_cell, bag):
        answer = live_cell.call("/move_to", "{x: 0.55, y: 0.10, z: 0.10, speed_percent: 30}")
        assert answer["success"], answer
        begun = _shadow_then(live_cell, -1e-3)["stamp"]
        answer = live_cell.call("/move_to", "{x: 0.65, y: 0.0, z: 0.0, speed_percent: 30}")
        assert answer["success"], answer
        assert not live_cell.call("/twin_controller/command", "{command: RESUME}")["success"]
        documents = _documents(live_cell, begun)

    said = live_cell.tool("rosrun", "twin_analysis", "replay_decisions", str(bag), timeout=120.0)
    assert ": 0 differences" in said, said
    assert "0 decisions and" not in said, said

    with open_bag(bag) as opened:
        setup_at, inputs = read_setups(opened), list(read_inputs(opened))
    for document in documents:
        again = json.loads(msgspec.json.encode(shadow_at(setup_at, inputs, document["stamp"])))
        _assert_same_pair(again, document)
    shown = live_cell.tool(
        "rosrun", "twin_analysis", "shadow", str(bag), "--time", repr(documents[-1]["stamp"])
    )
    _assert_same_pair(json.loads(shown), documents[-1])


@contextlib.contextmanager
def _recording(cell: LiveCell, bag: Path) -> Iterator[None]:
    """Record; a scene that ends early leaves no recording to the next one."""
    started = cell.call("/recorder/start", f"{{path: {bag}}}")
    assert started["success"], started
    try:
        yield
    finally:
        stopped = cell.call("/recorder/stop")
    assert stopped["success"], stopped


def _documents(cell: LiveCell, begun: float) -> list[dict[str, Any]]:
    """Return the controller's own documents from ``begun`` [s, ROS time] until now, evenly."""
    newest = _shadow_then(cell, -1e-3)["stamp"]
    step = (newest - begun) / COMPARED
    found = [_shadow_then(cell, begun + k * step) for k in range(1, COMPARED + 1)]
    assert any(not each["real"]["standing_still"] for each in found), "the robot did not move"
    return found


def _shadow_then(cell: LiveCell, time: float) -> dict[str, Any]:
    """Return the controller's own document of a time as its service counts it [s]."""
    from scara_msgs.srv import Shadow

    # Not by a tool of its own: that takes seconds on a busy machine, and the memory is short.
    with ServiceLine(cell.master_uri, "/twin_controller/shadow", Shadow, "/replay_test") as line:
        answer = line.call(ANSWER_S, time=time)
    assert answer.success, answer.message
    return dict(json.loads(answer.document))


def _assert_same_pair(again: dict[str, Any], document: dict[str, Any]) -> None:
    """Both documents say the same of the pair; ROS time is a double that counts from 1970."""
    for part in ("authority", "desired", "real", "twin", "units", "decision"):
        mine, recorded = again[part], document[part]
        if part in ("real", "twin"):
            assert mine["stamp"] == pytest.approx(recorded["stamp"], abs=1e-5)
            mine, recorded = ({**side, "stamp": None} for side in (mine, recorded))
        assert mine == recorded, f"{part} at {document['stamp']!r}"


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
