"""STOP reaches both sides, noise leads nobody, a storm moves nothing.

Releases: tests/virtual_time/test_stops.py.
"""

from __future__ import annotations

from random import Random

import pytest
from harness.faults import campaign, operator_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.rows import check

RACES = 12
"""Of seven seconds each, of fifteen beside other tests: forty were over a test's time."""
pytestmark = pytest.mark.system


def test_stop_is_on_both_wires_within_two_cycles(cell: FaultCell, rng: Random) -> None:
    """From any side, and none is lost."""
    check(lambda: operator_faults.stop_reaches_both(cell, rng, 1))


@pytest.mark.thorough
def test_both_sides_started_at_once_stay_together(cell: FaultCell, rng: Random) -> None:
    """One leads after the other, and they end together.

    Each gap is tried in virtual time: tests/virtual_time/test_both_at_once.py.
    """
    for _ in range(RACES):
        check(lambda: operator_faults.started_at_once(cell, rng))


@pytest.mark.thorough
def test_sensor_noise_makes_nobody_a_leader(cell: FaultCell, rng: Random) -> None:
    """An idle cell whose sensors are noisy stays idle.

    Here the noise comes over both wires; a whole minute of it passes in virtual time, in
    tests/unit/twin_controller/core/test_arbitration.py.
    """
    check(lambda: operator_faults.noisy(cell, rng, 4.0))


@pytest.mark.thorough
def test_storm_of_faults_moves_nothing_and_ends_idle(cell: FaultCell, rng: Random) -> None:
    """Cuts, silence, damage, stopped and killed processes at once, without any command.

    Each time test_storm plays them with commands besides.
    """
    check(lambda: campaign.storm(cell, rng, 6.0))
