"""A frames.yaml that is wrong keeps nobody from opening the page: STOP is on it."""

from __future__ import annotations

from pathlib import Path
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
    view = PageView(robot, load_panel(ROOT / "config"), around, nobody, nobody, nobody)
    view.read_frames()
    assert view.frames == NO_FRAMES and FILE in view.frames_fault
    wrong.write_text((FOLDER / FILE).read_text(encoding="utf-8"), encoding="utf-8")
    view.read_frames()
    assert view.frames == load_frames(FOLDER) and view.frames_fault == ""
