"""Somebody walks up to the robots, stands beside them, or is not seen any more, where separation is monitored."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
from harness.faults import person_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.person_faults import Person
from harness.faults.rows import check
from harness.ros import Master, Ros

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def person_and_cell(ros_master: Master, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Person, FaultCell]]:
    """Give a cell that monitors separation, and the person."""
    folder = tmp_path_factory.mktemp("separation")
    ros = Ros(ros_master, folder, "separation")
    try:
        with Person(ros) as person, FaultCell(ros, person_faults.monitored(folder / "config")) as cell:
            yield person, cell
    finally:
        ros.close()


@pytest.mark.parametrize("leader", ["real", "operator"])
def test_robot_stands_before_somebody_who_walks_in_reaches_it(
    person_and_cell: tuple[Person, FaultCell], rng: Random, leader: str
) -> None:
    """Both pause; RESUME is refused while the person is near, nothing goes on by itself afterwards, RESUME ends the move."""
    person, cell = person_and_cell
    check(lambda: person_faults.walks_in(cell, person, leader, rng))


def test_robot_is_slow_enough_beside_somebody_who_stands_by(person_and_cell: tuple[Person, FaultCell], rng: Random) -> None:
    """At each instant of the move the protective distance at the robot's speed is less than the distance."""
    person, cell = person_and_cell
    check(lambda: person_faults.stands_by(cell, person, rng))


def test_silent_sensor_counts_as_a_person_at_the_robot(person_and_cell: tuple[Person, FaultCell]) -> None:
    """The pair stops, refuses moves with the reason, and does not go on when the sensor sees again."""
    person, cell = person_and_cell
    check(lambda: person_faults.sensor_silent(cell, person))
