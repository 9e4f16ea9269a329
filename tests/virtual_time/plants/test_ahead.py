"""Set points ahead of their time: a controller that stands still is not noticed, a stop is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import pytest
from harness.plants.known_robot import knowing
from harness.plants.trials import run_trial
from harness.plants.variants import FIELD, IDEAL, ONE_BY_ONE, Variant
from harness.running.thorough import SEARCH, thorough
from harness.scenes.copies import copied
from harness.scenes.steps import both_stood, go
from harness.scenes.truth import standstill_since
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles
from harness.workspace import ROOT
from twin_controller.config import with_links

ROBOT = "fanuc_sr6ia"
PAUSES_S = tuple(1e-3 * ((37 * k) % 96 + 5) for k in range(30))
"""Thirty pauses of 5 to 100 ms, none like another."""
LONGEST_S = tuple(0.11 if k % 3 == 2 else pause for k, pause in enumerate(PAUSES_S))
"""Each third is the longest and 10 ms until a process that wakes has read and sent."""
PLACES = None if SEARCH else 3
"""So many places the twin goes to; by day the pauses of the way to the others are left out."""
WORSE = 1.5
"""So much worse than undisturbed a path may be."""


@dataclass(frozen=True)
class OnADesk(Variant):
    """A pair on a desk, as the demo is: a late process of ours is no lost link."""

    def files(self, robot: str, folder: Path = ROOT / "config") -> CellFiles:
        """Return the cell with the limits of a desk."""
        files = super().files(robot, folder)
        return replace(files, controller=with_links(files.controller, "desk"))


def shaken(plant: Variant, pauses: tuple[float, ...] = PAUSES_S) -> Variant:
    """Return the same robot with a controller that stands still thirty times."""
    return OnADesk(plant.name, plant.change, plant.plant, 0.0, pauses, 0.3, 0.35, plant.ahead)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("plant", "pauses"),
    [(IDEAL, LONGEST_S), (FIELD, PAUSES_S)],
    ids=["ideal", "field"],
)
def test_pauses_of_the_controller_cost_next_to_nothing(
    plant: Variant, pauses: tuple[float, ...]
) -> None:
    """At full speed, in a twin that leads: the robot has its set points."""
    calm = run_trial(ROBOT, plant, "twin_leads", 100.0, PLACES)
    found = run_trial(ROBOT, shaken(plant, pauses), "twin_leads", 100.0, PLACES)
    assert calm.path_percent is not None and found.path_percent is not None, (calm, found)
    assert calm.fastest_percent == pytest.approx(76.0, abs=0.5)
    assert found.path_percent <= WORSE * calm.path_percent, (calm, found)


@contextmanager
def moving(variant: Variant, delay_ms: float) -> Iterator[VirtualCell]:
    """Give a cell in full motion, to be stopped."""
    files = variant.files(ROBOT)
    files = replace(files, controller=knowing(files.controller, files.robot, delay_ms))
    with VirtualCell(files) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.5)
        go(cell, 50.0)
        cell.wait_whatever(lambda: max(map(abs, cell.real.shown.velocities)) > 1.5, 3.0, "speed")
        yield cell


def stopping_time(cell: VirtualCell, command: str) -> float:
    """Return how long the robot needs to stand after a command [s]; the twin comes to rest too.

    The twin's own ramp begins at its speed, which the robot's places for set points change.
    """
    begun = cell.schedule.now
    assert cell.operate(command).success
    both_stood(cell, begun)
    return standstill_since(cell.real.truth, begun) - begun


@pytest.mark.parametrize(
    ("ahead", "alone", "delay_ms"),
    [*thorough((IDEAL, ONE_BY_ONE[0], 18.0)), (FIELD, ONE_BY_ONE[1], 110.0)],
    ids=["ideal", "field"],
)
def test_a_stop_is_as_quick_with_set_points_ahead(
    ahead: Variant, alone: Variant, delay_ms: float
) -> None:
    """Nothing that was given before is driven after it; the same motion for each command."""
    with moving(ahead, delay_ms) as one, moving(alone, delay_ms) as other:
        for command in ("STOP", "ESTOP", "PAUSE"):
            took, before = (
                copied(partial(stopping_time, cell, command), float) for cell in (one, other)
            )
            assert took <= before + 0.02, (command, took, before)
