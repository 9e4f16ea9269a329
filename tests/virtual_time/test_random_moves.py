"""Random moves by both leaders on drawn plants, in virtual time: IDLE means that nothing moves.

Commands come from IDLE and into trims: the operator's, the twin's side's, programs of the robot.
"""

from __future__ import annotations

import pytest
from harness.running.thorough import thorough
from harness.scenes.random_moves import ROBOTS, random_moves

MOVES = 25
"""In one cell."""
SEEDS = range(1, 28)
"""For each robot: 2,025 moves in all."""
FEW = (("articulated_six", 9, 4),)
"""It takes 190 ms to end its stream, and is commanded again within them."""


@pytest.mark.parametrize(
    ("robot", "seed", "moves"),
    thorough(*FEW, *((robot, seed, MOVES) for robot in ROBOTS for seed in SEEDS)),
)
def test_random_moves_end_together_and_nothing_moves_in_idle(
    robot: str, seed: int, moves: int
) -> None:
    """Each move reaches its target or is replaced; the pair never comes apart or pauses itself."""
    found = random_moves(robot, seed, moves)
    assert found.moves >= moves
    assert found.wrong == []
