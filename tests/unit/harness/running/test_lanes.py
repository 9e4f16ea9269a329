"""Groups of tests and their order."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator

from harness.running.lanes import CELLS, LIVE, MORE_PURE, SHARED, TIMED, group_of, is_live, part_of
from harness.running.shared import Shared
from harness.workspace import ROOT

WAITS = re.compile(r"^(?:import|from) (?:asyncio|socket|threading|subprocess)\b", re.MULTILINE)
"""What a test imports that waits for somebody else."""
ONLY_COMPUTES = {
    "tests/unit/bench/test_bench.py": "no process: it only raises the error of one that hangs",
    "tests/unit/farm/desk/test_page_requests.py": "a loop that waits for nobody else",
    "tests/unit/operator_panel/page/test_frame_form.py": "a loop that waits for nobody else",
    "tests/unit/operator_panel/page/test_leading.py": "a loop that waits for nobody else",
    "tests/unit/operator_panel/page/test_only_looks.py": "a loop that waits for nobody else",
    "tests/unit/operator_panel/page/test_programs.py": "a loop that waits for nobody else",
    "tests/unit/operator_panel/page/test_target.py": "a loop that waits for nobody else",
    "tests/unit/operator_panel/teach/test_kept.py": "a loop that waits for the disk",
    "tests/unit/scara_control/dynamics/test_cleared_memory.py": "a process, whose end it waits for",
    "tests/unit/scara_control/dynamics/test_engine.py": "two processes, whose end it waits for",
    "tests/unit/scara_simulation/joints/test_compiled.py": "a compiler, whose end it waits for",
    "tests/unit/scara_simulation/simulator/test_real_time_runner.py": "a thread",
    "tests/unit/scara_simulation/simulator/test_simulation.py": "a lock that nobody else takes",
    "tests/unit/scara_simulation/simulator/test_tuning.py": "a lock that nobody else takes",
    "tests/unit/scara_simulation/simulator/test_world.py": "two processes, whose end it waits for",
    "tests/unit/setup/test_clients.py": "git and a build, whose end it waits for",
    "tests/unit/setup/test_pins.py": "pip, whose end it waits for",
    "tests/unit/setup/test_site.py": "a build of the site, whose end it waits for",
    "tests/unit/twin_controller/twin/test_rosbridge_socket.py": "a socket that is closed at once",
    "tests/unit/twin_experiments/test_mcap.py": "rosbags' converter, whose end it waits for",
    "tests/unit/twin_experiments/label/test_workspace.py": "git, whose end it waits for",
}


def test_what_has_processes_is_live() -> None:
    """Only a live test may be played again."""
    assert is_live("tests/system/faults/test_links.py::test_a[real]")
    assert is_live("tests/ros/test_gateway.py::test_a")
    assert not is_live("tests/virtual_time/test_stops.py::test_a")


def test_tests_of_a_shared_cell_are_one_group() -> None:
    """Else one of its workers would start a second cell."""
    for file, group in SHARED.items():
        assert (ROOT / file).is_file()
        assert group_of(f"{file}::test_a[x::y]") == group


def test_what_is_shared_is_made_once_and_ended_once() -> None:
    """The next group gets a new one."""
    ended: list[int] = []

    @contextlib.contextmanager
    def thing() -> Iterator[object]:
        yield object()
        ended.append(1)

    shared = Shared()
    assert "thing" not in shared
    first = shared.get("thing", thing)
    assert shared.get("thing", thing) is first and "thing" in shared and not ended
    shared.close()
    assert ended == [1] and "thing" not in shared
    shared.close()
    assert ended == [1]
    assert shared.get("thing", thing) is not first
    shared.close()


def test_what_waits_for_somebody_else_is_not_run_last_of_all() -> None:
    """With the processor time that others leave an answer may come late."""
    found = {
        path.relative_to(ROOT).as_posix()
        for path in ROOT.glob("tests/unit/**/test_*.py")
        if WAITS.search(path.read_text(encoding="utf-8"))
    }
    assert {file for file in found if part_of(file) in ("pure", "more_pure")} == set(ONLY_COMPUTES)


def test_names_of_parts_lead_to_tests() -> None:
    """A folder that was renamed would fall into another part."""
    assert not [name for name in (*CELLS, *LIVE, *TIMED, *MORE_PURE) if not (ROOT / name).exists()]
