"""A cell goes on without its ROS master; a new one makes it known to everybody again."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.faults.roscore_faults import MasterCell, master_killed, master_stopped
from harness.faults.rows import check

pytestmark = [pytest.mark.system, pytest.mark.thorough]


@pytest.fixture(scope="module")
def master_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MasterCell]:
    """Give a cell with a master of its own."""
    with MasterCell(tmp_path_factory.mktemp("roscore")) as cell:
        yield cell


def test_new_master_knows_all_topics_and_services_within_two_seconds(
    master_cell: MasterCell,
) -> None:
    """Nodes outlive their master, a running move too.

    Rospy alone would never register a service again. Each time the operator panel and the publisher
    of the robots' descriptions, which register as all nodes do, outlive one in tests/ros.
    """
    check(lambda: master_killed(master_cell))


def test_silent_master_holds_nobody_up(master_cell: MasterCell) -> None:
    """Links and motion need no master; what needs one is refused with the reason, in its time."""
    check(lambda: master_stopped(master_cell, 5.0))
