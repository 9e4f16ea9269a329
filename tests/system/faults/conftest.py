"""One breakable cell for the fault tests of a group; each test leaves it idle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from random import Random

import pytest
from harness.faults.fault_cell import FaultCell
from harness.ros import Master, Ros
from harness.running.shared import GROUP


@contextmanager
def breakable_cell(master: Master, folder: Path) -> Iterator[FaultCell]:
    """Give a running cell, and end it."""
    with closing(Ros(master, folder, "faults")) as ros, FaultCell(ros) as cell:
        yield cell


@pytest.fixture(scope="session")
def master_of_the_cell(ros_master: Master) -> Iterator[Master]:
    """Give the master; what the group shares ends before it, also at the end of the run."""
    yield ros_master
    GROUP.close()


@pytest.fixture(scope="module")
def fault_cell(master_of_the_cell: Master, tmp_path_factory: pytest.TempPathFactory) -> FaultCell:
    """Give a running cell with a relay on both wires; the group shares it."""
    made: FaultCell = GROUP.get(
        "breakable cell",
        lambda: breakable_cell(master_of_the_cell, tmp_path_factory.mktemp("faults")),
    )
    return made


@pytest.fixture
def cell(fault_cell: FaultCell) -> Iterator[FaultCell]:
    """Give the cell, set up as filed, and idle before and after."""
    fault_cell.set_up("")
    fault_cell.recover()
    yield fault_cell
    fault_cell.modbus.heal()
    fault_cell.web.heal()


@pytest.fixture
def rng() -> Random:
    """Give a generator with a fixed seed."""
    return Random(1)
