"""Web-socket clients that mean no good: the others feel nothing."""

from __future__ import annotations

from random import Random

import pytest
from harness.faults.campaign import ATTACKS
from harness.faults.fault_cell import FaultCell
from harness.faults.gateway_faults import attacked
from harness.faults.rows import check

pytestmark = pytest.mark.system
EACH_TIME = ("flood", "stalled")
"""The others are refused by what tests/unit/rosbridge_gateway holds with literal bytes."""


@pytest.mark.parametrize(
    "attack",
    [
        attack if attack in EACH_TIME else pytest.param(attack, marks=pytest.mark.thorough)
        for attack in ATTACKS
    ],
)
def test_attack_on_the_gateway_costs_the_others_nothing(
    cell: FaultCell, rng: Random, attack: str
) -> None:
    """Floods, 10 MB, depth, slow handshakes, a client that never reads.

    Memory bounded, no link lost.
    """
    check(lambda: attacked(cell, attack, rng, 3.5))
