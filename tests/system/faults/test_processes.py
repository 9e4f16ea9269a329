"""Processes that are killed without a farewell, or stand still and go on."""

from __future__ import annotations

from random import Random

import pytest
from harness.faults import process_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.rows import check

pytestmark = pytest.mark.system


def test_robot_stands_when_the_controller_is_killed(cell: FaultCell, rng: Random) -> None:
    """Within 0.2 s and its ramp.

    A new controller reads a baseline, aligns the twin, and moves nothing.
    """
    check(lambda: process_faults.controller_killed(cell, rng))


@pytest.mark.thorough
def test_watchdog_ends_the_robots_own_program_when_the_controller_is_killed(
    cell: FaultCell, rng: Random
) -> None:
    """A robot whose twin controller is gone moves without supervision.

    It stops itself, within 0.2 s and its ramp.
    """
    check(lambda: process_faults.controller_killed_under_a_program(cell, rng))


@pytest.mark.thorough
def test_controller_that_was_stopped_replays_nothing(cell: FaultCell, rng: Random) -> None:
    """After SIGCONT it finds its data old; what it wanted before is not done."""
    check(lambda: process_faults.controller_stopped(cell, rng))


def test_twin_stops_when_the_robot_is_gone_and_aligns_slowly_to_a_new_one(
    cell: FaultCell, rng: Random
) -> None:
    """Found within 0.1 s.

    The new robot stands elsewhere, and the twin goes there at a tenth of its speed.
    """
    check(lambda: process_faults.emulator_killed(cell, rng))


@pytest.mark.thorough
def test_robot_that_was_silent_stands_when_it_speaks_again(cell: FaultCell, rng: Random) -> None:
    """Its watchdog fires as soon as it runs."""
    check(lambda: process_faults.emulator_stopped(cell, rng))


@pytest.mark.parametrize(
    ("node", "how"),
    [
        pytest.param("gateway", "kill", marks=pytest.mark.thorough),
        pytest.param("gateway", "stop", marks=pytest.mark.thorough),
        ("simulator", "kill"),
        pytest.param("simulator", "stop", marks=pytest.mark.thorough),
        pytest.param("joint_pose_controller", "kill", marks=pytest.mark.thorough),
    ],
)
def test_robot_stands_when_a_node_of_the_twin_is_gone(
    cell: FaultCell, rng: Random, node: str, how: str
) -> None:
    """Noticed within 0.25 s, whichever node it is.

    The cell comes back with the node, and stands. A gateway that stands still is a line that is
    half open, in test_links.py.
    """
    check(lambda: process_faults.twin_side_gone(cell, node, how, rng))
