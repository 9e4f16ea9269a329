"""What the judge refuses reaches no wire, by whichever door of a whole cell it comes."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.second_world.refusing_cell import RefusingCell, refused_requests

pytestmark = [pytest.mark.system, pytest.mark.thorough]


@pytest.mark.parametrize("count", [20, 1000])
def test_refused_commands_put_no_set_point_on_any_wire(tmp_path: Path, count: int) -> None:
    """By MOVE, MOVE_JOINTS, move_to and the joint controller's service, all over the gateway.

    Then a free move shows that both counters count: to the twin's joints, and into the robot.
    """
    # A client that thinks for a minute meanwhile would be cut off.
    requests = refused_requests(count)
    with RefusingCell(tmp_path) as cell:
        assert cell.refuse(requests) == []
        assert (cell.setpoints, cell.writes) == (0, 0)
        cell.move()
        assert cell.setpoints > 0 and cell.writes > 0
