"""Somebody walks up to the robots of a live cell that monitors separation."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from random import Random

import pytest
from harness.faults import person_faults
from harness.faults.fault_cell import FaultCell
from harness.faults.person_faults import Person
from harness.faults.rows import check
from harness.ros import Master, Ros

pytestmark = [pytest.mark.system, pytest.mark.thorough]


@pytest.fixture(scope="module")
def person_and_cell(
    ros_master: Master, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Person, FaultCell]]:
    """Give a cell that monitors separation, and the person."""
    folder = tmp_path_factory.mktemp("separation")
    with (
        closing(Ros(ros_master, folder, "separation")) as ros,
        Person(ros) as person,
        FaultCell(ros, person_faults.monitored(folder / "config")) as cell,
    ):
        yield person, cell


def test_robot_stands_before_somebody_who_walks_in_reaches_it(
    person_and_cell: tuple[Person, FaultCell], rng: Random
) -> None:
    """Both pause; RESUME is refused while the person is near.

    Nothing goes on by itself afterwards; RESUME ends the move. Each time all scenes with a person
    are played in virtual time, in tests/virtual_time/test_separation.py, and a real sensor is heard
    over a real topic in tests/ros/twin_controller/test_sensors.py; live ``./cell bench --faults``.
    """
    person, cell = person_and_cell
    check(lambda: person_faults.walks_in(cell, person, "operator", rng))
