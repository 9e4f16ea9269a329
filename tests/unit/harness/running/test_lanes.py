"""Groups of tests and their order."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from harness.running import plugin
from harness.running.lanes import (
    CELLS,
    LIVE,
    PARTS,
    SHARED,
    TIMED,
    group_of,
    is_live,
    part_of,
    place,
    turns,
)
from harness.running.shared import Shared
from harness.workspace import ROOT

WAITS = re.compile(r"^(?:import|from) (?:asyncio|socket|threading|subprocess)\b", re.MULTILINE)
"""What a test imports that waits for somebody else."""
ONLY_COMPUTES = {
    "tests/unit/scara_control/dynamics/test_cleared_memory.py": "a process, whose end it waits for",
    "tests/unit/scara_control/dynamics/test_engine.py": "two processes, whose end it waits for",
    "tests/unit/scara_simulation/joints/test_compiled.py": "a compiler, whose end it waits for",
    "tests/unit/scara_simulation/simulator/test_real_time_runner.py": "a thread",
    "tests/unit/scara_simulation/simulator/test_world.py": "two processes, whose end it waits for",
    "tests/unit/setup/test_clients.py": "git and a build, whose end it waits for",
    "tests/unit/setup/test_pins.py": "pip, whose end it waits for",
    "tests/unit/setup/test_site.py": "a build of the site, whose end it waits for",
    "tests/unit/twin_experiments/test_mcap.py": "rosbags' converter, whose end it waits for",
    "tests/unit/twin_experiments/label/test_workspace.py": "git, whose end it waits for",
}


def test_the_longest_groups_begin_first() -> None:
    """A worker that gets the longest one last keeps the others waiting."""
    names = (
        "tests/unit/twin_controller/core/test_step.py::test_a",
        "tests/virtual_time/test_figures.py::test_a",
        "tests/contract/test_urdf.py::test_a",
    )
    places = [place(name) for name in names]
    assert places == sorted(places) and len({number for number, *_ in places}) == len(names)


def test_a_worker_that_has_become_a_node_gets_no_plain_socket_any_more() -> None:
    """Rospy gives every new socket of its process a time-out of its own."""
    names = ("tests/unit/setup/test_cell.py::test_a", "tests/ros/test_simulator.py::test_a")
    assert sorted(names, key=place) == list(names)


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


def test_a_file_of_its_own_is_a_group() -> None:
    """Its module fixtures are made once."""
    assert group_of("tests/ros/test_gateway.py::test_a") == "tests/ros/test_gateway.py"


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


PAGE, FARM_PAGE = "tests/ros/operator_panel/test_stop.py::test_a", "tests/ros/farm/test_wall.py::b"
PURE = "tests/unit/operator_panel/view/test_live.py::test_c"


@pytest.mark.parametrize(("following", "kept"), [(FARM_PAGE, True), (PURE, False), (None, False)])
def test_a_browser_is_kept_until_a_test_comes_that_drives_none(
    monkeypatch: pytest.MonkeyPatch, following: str | None, kept: bool
) -> None:
    """Playwright's loop runs as long as it does: no ``asyncio.run`` would."""
    for name in ("GROUP", "BROWSERS"):
        monkeypatch.setattr(plugin, name, Shared())
    for one in (plugin.GROUP, plugin.BROWSERS):
        one.get("thing", contextlib.nullcontext)
    item, after = (SimpleNamespace(nodeid=name) for name in (PAGE, following))
    torn_down = plugin.Running().pytest_runtest_teardown(item, after if following else None)
    next(torn_down)
    with pytest.raises(StopIteration):
        next(torn_down)
    assert ("thing" in plugin.BROWSERS, "thing" in plugin.GROUP) == (kept, False)


def test_one_worker_plays_the_tests_of_a_shared_cell_one_after_the_other() -> None:
    """Else its cell would end with another group's test and start again."""
    cell, page = (
        "tests/system/operation/test_cell.py",
        "tests/system/page/test_operator_page.py",
    )
    replay = "tests/system/test_replay.py"
    found = turns([f"{cell}::test_a", f"{page}::test_a", f"{cell}::test_b", f"{replay}::test_a"])
    assert found == {group_of(cell): 0, page: 1} and group_of(replay) == group_of(cell)


@pytest.mark.parametrize(
    ("file", "part"),
    [
        ("tests/system/test_demo.py", "cells"),
        ("tests/system/test_bringup.py", "starts"),
        ("tests/ros/operator_panel/test_stop.py", "pages"),
        ("tests/ros/operator_panel/test_for_hands.py", "pages"),
        ("tests/ros/farm/test_wall.py", "pages"),
        ("tests/system/page/test_operator_page.py", "cells"),
        ("tests/system/test_catkin_make.py", "pure"),
        ("tests/unit/twin_experiments/report/test_page_in_browser.py", "pages"),
        ("tests/ros/operator_panel/test_doors.py", "nodes"),
        ("tests/ros/test_emulator.py", "nodes"),
        ("tests/unit/scara_ros/page/test_page_door.py", "nodes"),
        ("tests/unit/scara_ros_of_another/test_a.py", "pure"),
        ("tests/virtual_time/test_stops.py", "pure"),
        ("tests/contract/test_docs.py", "pure"),
    ],
)
def test_each_file_is_in_one_part(file: str, part: str) -> None:
    """Parts run side by side: a file in none would never run."""
    assert part_of(file) == part and part in PARTS


def test_what_waits_for_somebody_else_is_not_run_last_of_all() -> None:
    """With the processor time that others leave an answer may come late."""
    found = {
        path.relative_to(ROOT).as_posix()
        for path in ROOT.glob("tests/unit/**/test_*.py")
        if WAITS.search(path.read_text(encoding="utf-8"))
    }
    assert {file for file in found if part_of(file) == "pure"} == set(ONLY_COMPUTES)


def test_names_of_parts_lead_to_tests() -> None:
    """A folder that was renamed would fall into another part."""
    assert not [name for name in (*CELLS, *LIVE, *TIMED) if not (ROOT / name).exists()]
