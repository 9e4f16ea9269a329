"""Which test runs when, where several processes share one machine.

``./cell test`` runs seven parts: whole cells one at a time; then single nodes and what looks at the
clock, three at a time; then pages in a browser, one at a time, beside what starts and ends programs
and judges no times, two at a time, and behind that beside more pages; and beside all of them what
only computes, in two processes, in the processor time that those leave (decisions 0022 and 0037).
The tests of one group go to one worker of pytest-xdist, one after the other; those of a shared cell
are one group.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache

from harness.workspace import ROOT

LIVE = ("tests/system/", "tests/ros/", "tests/clients/")
"""Tests that run in real time, with processes."""
PARTS = ("cells", "starts", "nodes", "more_pages", "pages", "pure", "more_pure")
"""What ``./cell test`` runs, and how: see above."""
CELLS = ("tests/system/",)
"""Whole cells: each wants one of two cores for itself."""
STARTS = (
    "tests/system/operation/test_refused.py",
    "tests/system/test_bringup.py",
    "tests/system/test_catkin_make.py",
    "tests/system/test_named_cell.py",
    "tests/unit/farm/desk/test_history.py",
    "tests/unit/farm/desk/test_rolling.py",
    "tests/unit/farm/lab/test_lab_far.py",
    "tests/unit/farm/lab/test_lab_running.py",
    "tests/unit/farm/line/",
    "tests/unit/harness/test_time_limit.py",
    "tests/unit/operator_panel/retelling/test_recordings.py",
    "tests/unit/setup/test_cell.py",
    "tests/unit/setup/test_examples.py",
    "tests/unit/setup/test_scopes.py",
    "tests/unit/setup/test_setup.py",
)
"""Cells and programs that each test starts and ends, and a build: it waits for them, and judges no
times."""
BROWSES = re.compile(
    r"^(?:from|import) (?:playwright|harness\.wires\.browser|harness\.page\.(?:hand|theatre))\b",
    re.MULTILINE,
)
"""What a test imports that drives a browser."""
MORE_PAGES = (
    "tests/ros/farm/",
    "tests/ros/operator_panel/jogging/",
    "tests/ros/operator_panel/preview/",
    "tests/ros/operator_panel/test_for_hands.py",
    "tests/ros/operator_panel/test_look_back.py",
)
"""Pages that are tested behind the starts, beside the others: a third of their time."""
MORE_PURE = (
    "tests/golden/",
    "tests/unit/twin_controller/",
    "tests/unit/what_if/",
    "tests/virtual_time/",
)
"""Half of what only computes, as its time goes: its other half runs beside it."""
TIMED = (
    "tests/unit/bench/test_journal.py",
    "tests/unit/cell_recorder/journal/test_writer.py",
    "tests/unit/fanuc_emulator/gripping/test_truth.py",
    "tests/unit/fanuc_emulator/modbus/",
    "tests/unit/fanuc_kit/test_kit.py",
    "tests/unit/farm/desk/test_alarm_desk.py",
    "tests/unit/farm/desk/test_comparing.py",
    "tests/unit/farm/desk/test_example.py",
    "tests/unit/farm/desk/test_figures.py",
    "tests/unit/farm/desk/test_recordings.py",
    "tests/unit/farm/link/test_cell_topics.py",
    "tests/unit/farm/security/test_strangers.py",
    "tests/unit/farm/test_bus.py",
    "tests/unit/harness/running/test_plugin.py",
    "tests/unit/harness/storm/",
    "tests/unit/harness/test_trial.py",
    "tests/unit/operator_panel/control/test_calling.py",
    "tests/unit/operator_panel/control/test_desk.py",
    "tests/unit/operator_panel/control/test_desk_jog.py",
    "tests/unit/operator_panel/control/test_stop_line.py",
    "tests/unit/operator_panel/link/test_camera_link.py",
    "tests/unit/operator_panel/link/test_cell_link.py",
    "tests/unit/operator_panel/link/test_listening.py",
    "tests/unit/operator_panel/link/test_register_reader.py",
    "tests/unit/operator_panel/page/test_landmarks.py",
    "tests/unit/operator_panel/page/test_teach_presses.py",
    "tests/unit/operator_panel/page/test_tuning.py",
    "tests/unit/operator_panel/page/test_twin_api.py",
    "tests/unit/operator_panel/retelling/test_bag_length.py",
    "tests/unit/operator_panel/retelling/test_run_folders.py",
    "tests/unit/operator_panel/view/test_live.py",
    "tests/unit/robot_doctor/test_robot_probe.py",
    "tests/unit/robot_doctor/test_set_up.py",
    "tests/unit/robot_doctor/test_stop_trials.py",
    "tests/unit/robot_doctor/test_twin_probe.py",
    "tests/unit/rosbridge_gateway/admission/",
    "tests/unit/rosbridge_gateway/graph/test_leaving.py",
    "tests/unit/rosbridge_gateway/server/",
    "tests/unit/scara_bringup/",
    "tests/unit/scara_control/dynamics/test_payload_listener.py",
    "tests/unit/scara_control/motion/test_command_listener.py",
    "tests/unit/scara_control/motion/test_idle.py",
    "tests/unit/scara_control/motion/test_lending.py",
    "tests/unit/scara_control/motion/test_motion_clock.py",
    "tests/unit/scara_control/motion/test_rest.py",
    "tests/unit/scara_ros/",
    "tests/unit/setup/test_nightly.py",
    "tests/unit/twin_controller/engine/test_engine.py",
    "tests/unit/twin_controller/engine/test_input_queue.py",
    "tests/unit/twin_controller/modbus/test_bad_answers.py",
    "tests/unit/twin_controller/modbus/test_follow_only.py",
    "tests/unit/twin_controller/modbus/test_link_writes.py",
    "tests/unit/twin_controller/modbus/test_modbus_link.py",
    "tests/unit/twin_controller/modbus/test_outbox.py",
    "tests/unit/twin_controller/modbus/test_writer.py",
    "tests/unit/twin_controller/reporting/test_publisher_thread.py",
    "tests/unit/twin_controller/robot/test_real_link.py",
    "tests/unit/twin_controller/services/test_command_services.py",
    "tests/unit/twin_controller/services/test_listeners.py",
    "tests/unit/twin_controller/services/test_own_programs.py",
    "tests/unit/twin_controller/twin/test_rosbridge_access.py",
    "tests/unit/twin_controller/twin/test_rosbridge_link.py",
    "tests/unit/twin_controller/twin/test_twin_link.py",
    "tests/unit/what_if/test_live_world.py",
)
"""Unit tests with sockets, threads or processes: they wait for answers, and for time to pass."""
SLOW = (
    "operator_panel/view/test_remedies.py",
    "scara_simulation/joints/test_compiled.py",
    "twin_controller/core/safety/test_braking.py",
    "twin_controller/core/safety/test_speed_limit.py",
    "twin_controller/core/test_arbitration.py",
    "twin_controller/core/test_faults.py",
    "twin_controller/core/test_late.py",
    "twin_controller/core/test_properties.py",
    "twin_controller/core/test_robustness.py",
    "twin_analysis/fit/",
    "twin_analysis/compare/test_compare_bags.py",
    "twin_analysis/replay/",
    "twin_experiments/report/test_analysis.py",
    "twin_experiments/test_report.py",
    "what_if/improving/",
    "what_if/test_campaign.py",
    "what_if/uncertainty/",
)
"""Unit tests that take many seconds: ``./cell check`` leaves them out."""
SHARED = {
    "tests/system/faults/test_attacks.py": "one breakable cell",
    "tests/system/faults/test_links.py": "one breakable cell",
    "tests/system/faults/test_processes.py": "one breakable cell",
    "tests/system/faults/test_recording.py": "one breakable cell",
    "tests/system/faults/test_stalled_orders.py": "one breakable cell",
    "tests/system/faults/test_stops.py": "one breakable cell",
    "tests/system/faults/test_storm.py": "one breakable cell",
    "tests/system/operation/test_cell.py": "one live cell",
    "tests/system/operation/test_trajectory.py": "one live cell",
    "tests/system/test_interfaces.py": "one live cell",
    "tests/system/test_listeners.py": "one live cell",
    "tests/system/test_replay.py": "one live cell",
    "tests/system/test_tutorial.py": "one live cell",
}
"""Files whose tests use one cell, started once."""
CONTRACT = "tests/contract/"
"""Rules over all modules: they share syntax trees (harness/sources.py)."""
ORDER = ("tests/unit/twin_controller/core/", "tests/virtual_time/")
"""Groups in the order of their beginning: the longest first, the rest last."""


def group_of(test: str) -> str:
    """Return the group of a test: its file, or what several files share.

    Args:
        test: Path of its file, or its node id, from the root of the project.
    """
    file = test.split("::", 1)[0]
    return CONTRACT if file.startswith(CONTRACT) else SHARED.get(file, file)


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
    """Return the part of ``./cell test`` that runs a file: one of ``PARTS``.

    Args:
        file: Its path from the root of the project.
    """
    if file.startswith(STARTS):
        return "starts"
    if file.startswith(CELLS):
        return "cells"
    if drives_browser(file):
        return "more_pages" if file.startswith(MORE_PAGES) else "pages"
    if file.startswith(LIVE + TIMED):
        return "nodes"
    return "more_pure" if file.startswith(MORE_PURE) else "pure"


@cache
def drives_browser(file: str) -> bool:
    """Return whether a test drives a browser: it imports what does."""
    path = ROOT / file
    return path.is_file() and bool(BROWSES.search(path.read_text(encoding="utf-8")))


def is_live(test: str) -> bool:
    """Return whether a test runs in real time."""
    return test.startswith(LIVE)
