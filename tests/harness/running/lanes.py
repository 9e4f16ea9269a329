"""Which test runs when, where several processes share one machine.

``./cell test`` runs three parts: whole cells and browsers one at a time, then single nodes and what
looks at the clock two at a time, and beside both what only computes, in the processor time that
those leave (decisions 0022 and 0037). The tests of one group go to one worker of pytest-xdist, one
after the other; those of a shared cell are one group.
"""

from __future__ import annotations

from collections.abc import Iterable

LIVE = ("tests/system/", "tests/ros/", "tests/clients/")
"""Tests that run in real time, with processes."""
PARTS = ("cells", "nodes", "pure")
"""What ``./cell test`` runs, and how: see above."""
CELLS = (
    "tests/system/",
    "tests/ros/farm/test_page.py",
    "tests/ros/operator_panel/preview/test_page_gate.py",
    "tests/ros/operator_panel/preview/test_page_judged.py",
    "tests/ros/operator_panel/test_jog_buttons.py",
    "tests/ros/operator_panel/test_stop.py",
    "tests/ros/operator_panel/test_tuning_form.py",
    "tests/ros/rosbridge_gateway/pages/test_page_from_file.py",
)
"""Whole cells, and browsers beside one: each wants one of two cores for itself."""
TIMED = (
    "tests/unit/bench/test_journal.py",
    "tests/unit/cell_recorder/journal/test_writer.py",
    "tests/unit/fanuc_emulator/modbus/",
    "tests/unit/fanuc_emulator/nodes/",
    "tests/unit/fanuc_emulator/other/",
    "tests/unit/fanuc_emulator/test_modbus_server.py",
    "tests/unit/farm/io/",
    "tests/unit/farm/line/",
    "tests/unit/harness/storm/",
    "tests/unit/harness/test_processes.py",
    "tests/unit/harness/test_proxy.py",
    "tests/unit/harness/test_trial.py",
    "tests/unit/operator_panel/io/",
    "tests/unit/operator_panel/nodes/",
    "tests/unit/rosbridge_gateway/admission/",
    "tests/unit/rosbridge_gateway/server/",
    "tests/unit/scara_bringup/",
    "tests/unit/scara_control/nodes/",
    "tests/unit/scara_ros/",
    "tests/unit/setup/",
    "tests/unit/twin_controller/io/",
    "tests/unit/twin_controller/nodes/",
)
"""Unit tests with sockets, threads or processes: they wait for answers, and for time to pass."""
BROWSER = "one browser"
SHARED = {
    "tests/ros/operator_panel/jogging/test_turn_steps.py": BROWSER,
    "tests/ros/operator_panel/preview/test_preview.py": BROWSER,
    "tests/ros/operator_panel/test_every_control.py": BROWSER,
    "tests/ros/operator_panel/test_for_hands.py": BROWSER,
    "tests/ros/operator_panel/test_look_back.py": BROWSER,
    "tests/ros/operator_panel/test_page_shows.py": BROWSER,
    "tests/ros/operator_panel/test_picture.py": BROWSER,
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
"""Files whose tests use one cell, started once, or a browser and a stage, one at a time."""
ORDER = ("tests/unit/twin_controller/core/", "tests/virtual_time/")
"""Groups in the order of their beginning: the longest first, the rest last."""


def group_of(test: str) -> str:
    """Return the group of a test: its file, or what several files share.

    Args:
        test: Path of its file, or its node id, from the root of the project.
    """
    file = test.split("::", 1)[0]
    return SHARED.get(file, file)


def place(test: str) -> tuple[int, bool, str]:
    """Return what the tests of a run with several workers are sorted by.

    Nodes of a worker come last: rospy gives every new socket of its process a time-out of its own.
    """
    group = group_of(test)
    fitting = [k for k, part in enumerate(ORDER) if group.startswith(part)]
    return min(fitting, default=len(ORDER)), is_live(test), group


def turns(tests: Iterable[str]) -> dict[str, int]:
    """Return the turn of each group: that of its first test in the order given."""
    found: dict[str, int] = {}
    for number, test in enumerate(tests):
        found.setdefault(group_of(test), number)
    return found


def part_of(file: str) -> str:
    """Return the part of ``./cell test`` that runs a file: ``cells``, ``nodes`` or ``pure``.

    Args:
        file: Its path from the root of the project.
    """
    if file.startswith(CELLS) or SHARED.get(file) == BROWSER:
        return "cells"
    return "nodes" if file.startswith(LIVE + TIMED) else "pure"


def is_live(test: str) -> bool:
    """Return whether a test runs in real time."""
    return test.startswith(LIVE)
