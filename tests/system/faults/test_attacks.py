"""Web-socket clients that mean no good: the others feel nothing.

By day they are refused by what tests/unit/rosbridge_gateway holds with literal bytes.
"""

from __future__ import annotations

import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor
from random import Random

import pytest
from harness.faults.campaign import ATTACKS
from harness.faults.fault_cell import FaultCell
from harness.faults.gateway_faults import attacked
from harness.faults.link_faults import losses
from harness.faults.rows import Row, check
from harness.opponents import hostile_pages

pytestmark = [pytest.mark.system, pytest.mark.thorough]


@pytest.mark.parametrize("attack", ATTACKS)
def test_attack_on_the_gateway_costs_the_others_nothing(
    cell: FaultCell, rng: Random, attack: str
) -> None:
    """Floods, 10 MB, depth, slow handshakes, a client that never reads.

    Memory bounded, no link lost.
    """
    check(lambda: attacked(cell, attack, rng, 3.5))


@pytest.mark.parametrize("seconds", [5.0, 60.0])
def test_hostile_pages_part_no_moving_pair(cell: FaultCell, seconds: float) -> None:
    """Eight at once, while the robot leads from pose to pose: no link is ever stale.

    Each time other clients' answers come in time beside the same pages, in
    tests/ros/rosbridge_gateway/pages/test_hostile_pages.py.
    """

    def measure() -> list[Row]:
        cell.recover()
        begun, end = time.time(), time.monotonic() + seconds
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            pages = pool.submit(hostile_pages.visit, cell.gateway_port, seconds)
            moves = 0
            while time.monotonic() < end:
                cell.visit(speed_percent=50.0)
                moves += 1
            sent = pages.result()
        fault = f"gateway: eight hostile pages beside a moving pair for {seconds:g} s"
        return [
            Row(fault, "MB that they sent", 1.0, sent / 1e6, at_least=True),
            Row(fault, "moves of the pair", 1.0, float(moves), at_least=True),
            losses(cell, fault, begun),
        ]

    check(measure)
