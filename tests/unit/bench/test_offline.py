"""The bench's simulated cell is put together as the simulator's node does it."""

from __future__ import annotations

import pytest
from scara_config import load_robot

from bench.world.offline import offline_twin


@pytest.mark.parametrize("parts", [True, False])
def test_the_cell_of_the_bench_holds_its_start_pose(parts: bool) -> None:
    """Rows that simulate need it: it follows each change of the node's own wiring."""
    robot = load_robot()
    with offline_twin(robot, parts=parts) as (world, simulation):
        simulation.advance(10)
        positions, _ = world.read()
    assert positions == pytest.approx(list(robot.home_positions), abs=1e-6)
