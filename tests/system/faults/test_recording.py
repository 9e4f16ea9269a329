"""Recordings survive what happens to the recorder and its disk."""

from __future__ import annotations

from random import Random

import pytest
from harness.faults import recording_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.rows import check

pytestmark = pytest.mark.system


@pytest.mark.thorough
def test_killed_recorder_loses_a_fifth_of_a_second_at_most(cell: FaultCell, rng: Random) -> None:
    """Our tools read the rest at once, standard tools after a reindex; no less than those do.

    Each time one is killed in tests/ros/cell_recorder/test_recorder.py.
    """
    check(lambda: recording_faults.recorder_killed(cell, rng))


def test_recorder_that_stands_still_holds_nobody_up(cell: FaultCell, rng: Random) -> None:
    """Publishers do not wait for a subscriber; it records again when it goes on."""
    check(lambda: recording_faults.recorder_stopped(cell, rng))


@pytest.mark.thorough
def test_full_disk_ends_the_recording_and_nothing_else(cell: FaultCell, rng: Random) -> None:
    """All before it is kept, /diagnostics says ERROR within 1 s, the control feels nothing.

    Each time a disk is full in tests/ros/cell_recorder/test_recorder.py.
    """
    check(lambda: recording_faults.disk_full(cell, rng))
