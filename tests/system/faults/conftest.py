"""One breakable cell for all fault tests of a file; each test leaves it idle."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
from harness.faults.fault_cell import FaultCell
from harness.ros import Master, Ros


@pytest.fixture(scope="module")
def fault_cell(ros_master: Master, tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultCell]:
    """Give a running cell with a relay on both wires of the twin controller."""
    ros = Ros(ros_master, tmp_path_factory.mktemp("faults"), "faults")
    try:
        with FaultCell(ros) as cell:
            yield cell
    finally:
        ros.close()


@pytest.fixture
def cell(fault_cell: FaultCell) -> Iterator[FaultCell]:
    """Give the cell, idle before and after."""
    fault_cell.recover()
    yield fault_cell
    fault_cell.modbus.heal()
    fault_cell.web.heal()


@pytest.fixture
def rng() -> Random:
    """Give a generator with a fixed seed."""
    return Random(1)
