"""The two wires of the twin controller fail in every way.

Each test states what may happen and within which time.
"""

from __future__ import annotations

from random import Random

import pytest
from harness.faults import link_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.rows import check
from harness.running.thorough import thorough

pytestmark = pytest.mark.system
SIDES = pytest.mark.parametrize("side", ["real", "twin"])
ONE_SIDE = pytest.mark.parametrize("side", ["real", *thorough("twin")])
"""A twin's line is cut each time while it is on its own way; bad packets have unit tests."""


@ONE_SIDE
def test_half_open_line_is_found_and_the_robot_stands(
    cell: FaultCell, side: str, rng: Random
) -> None:
    """Modbus within 0.1 s, the web socket within 0.25 s.

    The robot stands 0.2 s and a ramp later; nothing is replayed.
    """
    check(lambda: link_faults.frozen(cell, side, rng))


@ONE_SIDE
def test_line_that_is_cut_stops_the_robot_and_nothing_goes_on_by_itself(
    cell: FaultCell, side: str, rng: Random
) -> None:
    """After the reconnect the pair aligns and stands, until somebody gives a new command."""
    check(lambda: link_faults.cut(cell, side, rng))


@pytest.mark.parametrize("how", ["cut", *thorough("half-open")])
def test_a_twin_on_its_own_way_stops_when_its_line_is_lost(
    cell: FaultCell, how: str, rng: Random
) -> None:
    """Nobody at the real robot follows it any longer; it stands a ramp after that is found."""
    check(lambda: link_faults.own_way(cell, how, rng))


@pytest.mark.thorough
@SIDES
def test_peer_that_refuses_is_found_again(cell: FaultCell, side: str, rng: Random) -> None:
    """The pause between attempts is bounded, and a link that came back moves nothing."""
    check(lambda: link_faults.refused(cell, side, rng))


@pytest.mark.thorough
@SIDES
def test_slow_line_loses_nothing(cell: FaultCell, side: str, rng: Random) -> None:
    """4 to 10 ms more for each answer, 10 to 20 ms each way to the twin: no time-out."""
    check(lambda: link_faults.slow_line(cell, side, rng))


@pytest.mark.thorough
@SIDES
def test_bytes_that_come_one_by_one_are_put_together(
    cell: FaultCell, side: str, rng: Random
) -> None:
    """Segments are no packets."""
    check(lambda: link_faults.byte_by_byte(cell, side, rng))


@ONE_SIDE
def test_damaged_answers_move_nothing(cell: FaultCell, side: str, rng: Random) -> None:
    """Duplicated, corrupted, truncated, dropped and swapped units.

    No leader, no motion, idle again afterwards.
    """
    check(lambda: link_faults.damaged(cell, side, rng, 4.0))
