"""Old names of executables: they work, and say the new one."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest
from scara_ros.nodes.moved import run_moved


def test_the_new_main_runs_and_one_line_says_its_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On stderr, so that what reads the node's output sees no difference."""
    ran: list[str] = []
    module = ModuleType("new_room.nodes.thing")
    module.main = lambda: ran.append("new")  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "new_room", ModuleType("new_room"))
    monkeypatch.setitem(sys.modules, "new_room.nodes", ModuleType("new_room.nodes"))
    monkeypatch.setitem(sys.modules, "new_room.nodes.thing", module)
    run_moved("old_room", "thing", now_in="new_room")
    printed = capsys.readouterr()
    assert ran == ["new"] and printed.out == ""
    assert printed.err == "rosrun old_room thing: it moved; use: rosrun new_room thing\n"
