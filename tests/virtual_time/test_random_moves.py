"""Random moves by both leaders on drawn plants, in virtual time: IDLE means that nothing moves.

Commands come from IDLE and into trims: the operator's, the twin's side's, programs of the robot.
"""

from __future__ import annotations

import pytest
from harness.scenes.random_moves import ROBOTS, random_moves

MOVES = 25
"""In one cell."""
SEEDS = range(1, 28)
"""For each robot: 2,025 moves in all. The first four of articulated_six with seed 9 come within the
190 ms that it takes to end its stream."""


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("seed", SEEDS)
def test_random_moves_end_together_and_nothing_moves_in_idle(robot: str, seed: int) -> None:
    """Each move reaches its target or is replaced; the pair never comes apart or pauses itself."""
    found = random_moves(robot, seed, MOVES)
    assert found.moves >= MOVES
    assert found.wrong == []
