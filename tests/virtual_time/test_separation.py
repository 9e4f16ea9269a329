"""Somebody near the robot, in virtual time: the real core, the real stand-in, the real twin.

How near a person comes before the robot stands is judged here to the millimetre. One scene in a
whole cell, tests/system/faults/test_separation.py, has a real sensor on a real topic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from random import Random

import msgspec
import pytest
from harness.faults.person_faults import KEPT_MM, STALE_S, STANDS_M_S, protective
from harness.opponents.person import FAR, PERIOD_S, WALK_M_S, Place, place
from harness.running.thorough import thorough
from harness.scenes.steps import ROBOT, both_stood, go, nothing_moves, run_program
from harness.scenes.truth import standstill_since, tool_and_elbow, tool_speed, travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files
from twin_controller.core.events import PersonSeen

REACTION_S = 0.1
RAMP_S = 0.35
"""The longest stop of the stand-in and of the twin from the speeds of these scenes."""


class MonitoredCell(VirtualCell):
    """A cell that monitors separation, and somebody whom a sensor sees twenty times a second."""

    def __init__(self) -> None:
        """Connect; the person is far away."""
        files = load_files(ROBOT)
        separation = msgspec.structs.replace(
            files.controller.separation, enabled=True, sensors=("",)
        )
        controller = msgspec.structs.replace(files.controller, separation=separation)
        super().__init__(replace(files, controller=controller))
        self._walks = [(0.0, FAR, FAR, 1.0)]
        self.seen = True
        self.schedule.every(PERIOD_S, self._look, 0.0023)
        self.connect()

    def stand(self, at: Place) -> None:
        """Let the person be there from now on."""
        self._walks.append((self.schedule.now, at, at, 1.0))

    def walk(self, end: Place, speed: float = WALK_M_S) -> float:
        """Let the person walk straight to ``end``; return when it began."""
        now = self.schedule.now
        self._walks.append((now, self.person(now), end, speed))
        return now

    def person(self, at: float) -> Place:
        """Return where the person is at a time."""
        return place([walk for walk in self._walks if walk[0] <= at][-1], at)

    def distance_mm(self, at: float) -> float:
        """Return how far the person was from the robot's tool or elbow."""
        before = [q for when, q, _ in self.real.truth if when <= at][-1]
        return 1e3 * min(math.dist(point, self.person(at)) for point in tool_and_elbow(before))

    def wait_for(self, mode: str, limit: float) -> None:
        """Wait for a mode, whatever it is."""
        self.wait_whatever(lambda: self.mode == mode, limit, mode)

    def _look(self) -> None:
        if self.seen:
            self.put(PersonSeen(self.clock(), self.person(self.schedule.now)))


@pytest.fixture
def cell() -> Iterator[MonitoredCell]:
    """Give an idle cell that monitors separation."""
    with MonitoredCell() as made:
        yield made


def test_cell_reads_what_the_tests_reckon_with(cell: MonitoredCell) -> None:
    """The numbers of the formula in these tests are those of the configuration."""
    terms = cell.setup.config.separation
    assert terms.enabled
    assert terms.human_speed_mm_s == WALK_M_S * 1e3 and terms.stale_ms == STALE_S * 1e3
    kept = terms.intrusion_mm + terms.sensor_uncertainty_mm + terms.robot_uncertainty_mm
    assert kept == KEPT_MM


@pytest.mark.parametrize("leader", ["real", "operator"])
@pytest.mark.parametrize("seed", [1, *thorough(2)])
def test_robot_stands_before_somebody_who_walks_in_reaches_it(
    cell: MonitoredCell, leader: str, seed: int
) -> None:
    """Both pause; RESUME is refused while the person is near, and lets them go on afterwards."""
    rng = Random(seed)
    angle = rng.uniform(-0.5, 0.5)
    run_program(cell) if leader == "real" else go(cell, 5.0)
    cell.stand((2.2 * math.cos(angle), 2.2 * math.sin(angle), rng.uniform(0.0, 0.5)))
    begun = cell.walk((0.5, 0.1, 0.2))
    cell.wait_for("PAUSED", 10.0)
    both_stood(cell, begun)
    assert cell.distance_mm(standstill_since(cell.real.truth, begun)) >= KEPT_MM
    rested = cell.schedule.now
    answer = cell.operate("RESUME")
    assert not answer.success and "mm away" in answer.message
    cell.walk(FAR, 3.0)
    nothing_moves(cell, rested)
    cell.wait_whatever(lambda: cell.operate("RESUME").success, 10.0, "a way on")
    resumed = cell.schedule.now
    cell.schedule.run(1.0)
    assert travel(cell.real.truth, resumed) > 1.0 and "LEADS" in cell.mode


@pytest.mark.thorough
@pytest.mark.parametrize("away", [1.3, 1.6])
def test_robot_is_slow_enough_beside_somebody_who_stands_by(
    cell: MonitoredCell, away: float
) -> None:
    """At each instant the protective distance at the robot's speed is less than the distance."""
    cell.stand((away * math.cos(0.9), away * math.sin(0.9), 0.2))
    cell.schedule.run(4 * PERIOD_S)
    begun = cell.schedule.now
    go(cell, 30.0)
    cell.wait_for("IDLE", 60.0)
    rows = [(at, q, tool_speed(q, qdot)) for at, q, qdot in cell.real.truth if at >= begun]
    assert max(speed for _, _, speed in rows) > 0.1
    person = cell.person(begun)
    for _, q, speed in rows:
        if speed > STANDS_M_S:
            distance = min(math.dist(point, person) for point in tool_and_elbow(q))
            assert protective(speed) <= distance


def test_silent_sensor_counts_as_a_person_at_the_robot(cell: MonitoredCell) -> None:
    """The pair stops, refuses moves, and does not go on when the sensor sees again."""
    go(cell, 5.0)
    cell.seen, begun = False, cell.schedule.now
    cell.wait_for("PAUSED", 10.0)
    assert cell.schedule.now - begun <= STALE_S + PERIOD_S + 0.02
    assert both_stood(cell, begun) - begun <= STALE_S + PERIOD_S + REACTION_S + RAMP_S
    rested = cell.schedule.now
    answer = cell.operate("RESUME")
    assert not answer.success and "silent" in answer.message
    assert cell.operate("STOP").success
    cell.wait_for("STOPPED", 5.0)
    answer = cell.operate("ALIGN")
    assert not answer.success and "silent" in answer.message
    cell.seen = True
    nothing_moves(cell, rested)
