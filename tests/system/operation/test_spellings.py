"""A second cell beside one without a namespace, in each spelling that ROS takes for a namespace."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.live_cell import LiveCell
from harness.processes import wait_until
from harness.ros import Master

pytestmark = [pytest.mark.system, pytest.mark.thorough]

SPELLINGS = {
    "cell_3": "/cell_3",
    "/cell_4": "/cell_4",
    "cell_5/": "/cell_5",
    "/cell_6/": "/cell_6",
    "line_1/cell_7": "/line_1/cell_7",
}


@pytest.fixture(scope="module")
def first(ros_master: Master, tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give the cell without a namespace, ready."""
    with LiveCell(tmp_path_factory.mktemp("first"), ros_master.uri).ready() as cell:
        yield cell


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_second_cell_is_ready_and_apart_in_every_spelling(
    first: LiveCell, spelling: str, ros_master: Master, tmp_path: Path
) -> None:
    """Its names are those of the one form; its emergency stop is its own."""
    namespace = SPELLINGS[spelling]
    with LiveCell(tmp_path, ros_master.uri, spelling).ready() as second:
        first.make_ready()
        second.make_ready()
        nodes = second.tool("rosnode", "list").split()
        assert f"{namespace}/twin_controller" in nodes and "/twin_controller" in nodes
        asked = second.call(f"{namespace}/twin_controller/command", "{command: ESTOP}")
        assert asked["success"], asked
        wait_until(lambda: second.mode() == "ESTOP", 10.0, "its emergency stop")
        assert first.mode() == "IDLE"
        assert second.call(f"{namespace}/twin_controller/reset")["success"]
        second.make_ready()
