"""STOP reaches both sides, releases move nothing, noise leads nobody."""

from __future__ import annotations

from random import Random

import pytest
from harness.faults import campaign, operator_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.rows import check

pytestmark = pytest.mark.system


def test_stop_is_on_both_wires_within_two_cycles(cell: FaultCell, rng: Random) -> None:
    """From any side, and none is lost."""
    check(lambda: operator_faults.stop_reaches_both(cell, rng, 1))


def test_release_of_an_emergency_stop_moves_nothing(cell: FaultCell, rng: Random) -> None:
    """RESET and ALIGN give no motion back."""
    check(lambda: operator_faults.estop_released(cell, rng))


def test_release_of_a_hold_moves_nothing_after_stop(cell: FaultCell, rng: Random) -> None:
    """STOP clears the program of the robot; the hold ends with it, and the robot stays."""
    check(lambda: operator_faults.hold_released(cell, rng))


def test_sensor_noise_makes_nobody_a_leader(cell: FaultCell, rng: Random) -> None:
    """An idle cell whose sensors are noisy stays idle."""
    check(lambda: operator_faults.noisy(cell, rng, 20.0))


def test_storm_of_faults_moves_nothing_and_ends_idle(cell: FaultCell, rng: Random) -> None:
    """Cuts, silence, damage, stopped and killed processes at once, without any command."""
    check(lambda: campaign.storm(cell, rng, 6.0))
