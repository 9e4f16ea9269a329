"""Which test runs when, where several workers (pytest-xdist) share one machine.

The tests of one group go to one worker, one after the other; those of a shared cell are one group.
Whole cells and browsers never share the machine: ``./cell test`` runs them by one worker.
"""

from __future__ import annotations

from collections.abc import Iterable

LIVE = ("tests/system/", "tests/ros/", "tests/clients/")
"""Tests that run in real time, with processes."""
SHARED = {
    "tests/system/faults/test_attacks.py": "one breakable cell",
    "tests/system/faults/test_links.py": "one breakable cell",
    "tests/system/faults/test_processes.py": "one breakable cell",
    "tests/system/faults/test_recording.py": "one breakable cell",
    "tests/system/faults/test_stops.py": "one breakable cell",
    "tests/system/faults/test_storm.py": "one breakable cell",
    "tests/system/operation/test_cell.py": "one live cell",
    "tests/system/operation/test_trajectory.py": "one live cell",
    "tests/system/test_interfaces.py": "one live cell",
    "tests/system/test_listeners.py": "one live cell",
    "tests/system/test_replay.py": "one live cell",
}
"""Files whose tests use one cell, started once."""
ORDER = ("tests/unit/twin_controller/core/", "tests/virtual_time/")
"""Groups in the order of their beginning: the longest first, the rest last."""


def group_of(test: str) -> str:
    """Return the group of a test: its file, or what several files share.

    Args:
        test: Path of its file, or its node id, from the root of the project.
    """
    file = test.split("::", 1)[0]
    return SHARED.get(file, file)


def place(test: str) -> tuple[int, str]:
    """Return what the tests of a run are sorted by."""
    group = group_of(test)
    fitting = [k for k, part in enumerate(ORDER) if group.startswith(part)]
    return min(fitting, default=len(ORDER)), group


def turns(tests: Iterable[str]) -> dict[str, int]:
    """Return the turn of each group: that of its first test in the order given."""
    found: dict[str, int] = {}
    for number, test in enumerate(tests):
        found.setdefault(group_of(test), number)
    return found


def is_live(test: str) -> bool:
    """Return whether a test runs in real time."""
    return test.startswith(LIVE)
