"""A frames.yaml that is wrong keeps nobody from opening the page: STOP is on it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
from harness.workspace import ROOT
from operator_panel.config import load_panel, load_surroundings
from operator_panel.page.view_io import PageView
from scara_config import load_robot
from scara_config.frames import FILE, NO_FRAMES, load_frames

FOLDER = ROOT / "config" / "robots" / "fanuc_sr6ia"


def test_a_page_opens_without_frames_and_says_why_until_the_file_is_mended(tmp_path: Path) -> None:
    """The fault names the file; once it is mended, the frames are there."""
    robot, wrong = load_robot(ROOT / "config"), tmp_path / FILE
    around = msgspec.structs.replace(load_surroundings(robot, ROOT / "config"), folder=tmp_path)
    wrong.write_text("user: 7\n", encoding="utf-8")
    nobody: Any = None
    jogged: list[list[str]] = []
    arm = SimpleNamespace(set_frames=lambda frames: jogged.append(list(frames)))
    desk: Any = SimpleNamespace(arm=arm)
    view = PageView(robot, load_panel(ROOT / "config"), around, nobody, desk, nobody)
    view.read_frames()
    assert view.frames == NO_FRAMES and FILE in view.frames_fault
    assert jogged == [], "what was taught before is not lost for a slip of the pen"
    shown: list[str] = []
    view.on_frames(lambda: shown.append(view.frames_fault))
    assert len(shown) == 1
    wrong.write_text((FOLDER / FILE).read_text(encoding="utf-8"), encoding="utf-8")
    view.read_frames()
    assert view.frames == load_frames(FOLDER) and view.frames_fault == ""
    assert jogged == [["1 pallet", "2 vehicle"]] and shown[1:] == [""]
    view.read_frames()
    assert len(shown) == 2, "nothing has changed"
