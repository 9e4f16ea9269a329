"""frames.yaml: read, missing, wrong, and written in place."""

from __future__ import annotations

from pathlib import Path

import pytest
from scara_config import ConfigError
from scara_config.frames import FILE, NO_FRAMES, TaughtFrame, find_frames, save_frame

CLAMP = TaughtFrame("clamp", (10.00004, 20.0, 30.0), (0.0, 0.0, 45.000001))
TEXT = """\
user:
  uframe_1:
    name: pallet   # measured twice
    xyz_mm: [1.0, 2.0, 3.0]
tool: {}
"""


def test_a_robot_without_the_file_has_no_frames(tmp_path: Path) -> None:
    """And the first one that is taught makes it."""
    assert find_frames(tmp_path) == NO_FRAMES
    save_frame(tmp_path, "tool", 2, CLAMP)
    found = find_frames(tmp_path)
    assert found.user == {} and found.find("tool", 2).xyz_mm == (10.0, 20.0, 30.0)
    assert found.find("tool", 2).wpr_deg == (0.0, 0.0, 45.0)


def test_a_taught_frame_leaves_the_others_and_all_comments(tmp_path: Path) -> None:
    """A new one is added, an old one is replaced."""
    (tmp_path / FILE).write_text(TEXT, encoding="utf-8")
    save_frame(tmp_path, "user", 3, CLAMP)
    save_frame(tmp_path, "user", 1, TaughtFrame("box", (4.0, 5.0, 6.0)))
    found = find_frames(tmp_path)
    assert found.find("user", 3).name == "clamp"
    assert found.find("user", 1) == TaughtFrame("box", (4.0, 5.0, 6.0))
    assert "# measured twice" in (tmp_path / FILE).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("uframe_1:", "uframe_0:", "uframe_0"),
        ("[1.0, 2.0, 3.0]", "[1.0, 2.0]", "xyz_mm"),
        ("pallet ", '"" ', "name"),
        ("    xyz_mm", "    place_mm", "place_mm"),
    ],
)
def test_a_wrong_file_names_its_fault(tmp_path: Path, old: str, new: str, why: str) -> None:
    """File, key and value."""
    (tmp_path / FILE).write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=f"{FILE}.*{why}"):
        find_frames(tmp_path)


def test_a_number_that_no_controller_has_is_refused(tmp_path: Path) -> None:
    """Nothing is written."""
    with pytest.raises(ConfigError, match="user frame 10: allowed are 1 to 9"):
        save_frame(tmp_path, "user", 10, CLAMP)
    assert not (tmp_path / FILE).exists()
