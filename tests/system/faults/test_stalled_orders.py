"""Never a motion of either side from before an acknowledged STOP, whichever node stood still."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.faults.fault_cell import FaultCell
from harness.running.thorough import thorough
from harness.scenes.stalled_orders import MORE_NODES, ROUTES, Orders, Round, draw

REST_DEG = 0.005
"""Twice what loops and filters leave of a joint at rest; mm for joint_3."""
SEED = 1
ROUNDS = draw(SEED, 8 * len(ROUTES))
BY_WEB = Round("gateway", "move_to by web", 0.121, 0.366)
"""Both the point and the STOP wait in the gateway."""
FIRST = [Round(node, orders[0], 0.15, 0.5) for node, orders in ROUTES.items()]
CONTROLS = [
    Round(node, order, 0.05, None)
    for order, node in {order: node for node, orders in ROUTES.items() for order in orders}.items()
]
"""Each order without a STOP: what nobody carries out shows nothing about STOP."""


@pytest.fixture(scope="module")
def orders(fault_cell: FaultCell) -> Iterator[Orders]:
    """Let all motion nodes run."""
    fault_cell.recover()
    with fault_cell.beside(*MORE_NODES), Orders(fault_cell) as opened:
        yield opened


@pytest.mark.parametrize("scene", [*FIRST, BY_WEB, *thorough(*((one,) for one in ROUNDS))])
def test_what_was_asked_for_before_a_stop_moves_neither_side(orders: Orders, scene: Round) -> None:
    """The node finds the request and the STOP side by side, or only the request."""
    found = orders.play(scene)
    print(found)
    assert found.stopped
    assert found.real <= REST_DEG and found.twin <= REST_DEG, str(found)


@pytest.mark.parametrize("scene", [CONTROLS[0], *thorough(*((one,) for one in CONTROLS[1:]))])
def test_the_same_without_a_stop_moves_the_twin(orders: Orders, scene: Round) -> None:
    """So it is the STOP that the other rounds show."""
    found = orders.play(scene)
    print(found)
    assert not found.stopped and found.twin > 20.0 * REST_DEG, str(found)
