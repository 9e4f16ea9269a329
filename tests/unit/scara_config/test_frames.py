"""frames.yaml: read, missing, wrong, and written in place."""

from __future__ import annotations

from pathlib import Path

import pytest
from scara_config import ConfigError
from scara_config.frames import (
    FILE,
    LETTERS,
    NO_FRAMES,
    FrameTable,
    Kind,
    TaughtFrame,
    find_frames,
    frame_differences,
    save_frame,
    save_theirs,
)

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


def test_a_taught_frame_is_kept_more_finely_than_a_controller_prints_it(tmp_path: Path) -> None:
    """Each number; what is finer still is noise."""
    fine = TaughtFrame("fine", (10.1234, 20.1234, 30.1234), (5.12345, 6.12345, 7.12345))
    noisy = TaughtFrame(
        "fine", *(tuple(x + 4e-6 for x in each) for each in (fine.xyz_mm, fine.wpr_deg))
    )
    save_frame(tmp_path, "user", 1, noisy)
    assert find_frames(tmp_path).find("user", 1) == fine


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
        ("3.0]", "3.0]\n    wpr: [1.0, 2.0, 3.0]", "wpr"),
        ("tool: {}", "tool: {}\nbase: {}", "base"),
    ],
)
def test_a_wrong_file_names_its_fault(tmp_path: Path, old: str, new: str, why: str) -> None:
    """File, key and value."""
    (tmp_path / FILE).write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=f"{FILE}.*{why}"):
        find_frames(tmp_path)


@pytest.mark.parametrize(
    ("kind", "number", "most"), [("user", 0, 9), ("user", 10, 9), ("tool", 11, 10)]
)
def test_a_number_that_no_controller_has_is_refused(
    tmp_path: Path, kind: Kind, number: int, most: int
) -> None:
    """Nothing is written; the last one that it has is taken."""
    with pytest.raises(ConfigError, match=f"{kind} frame {number}: allowed are 1 to {most}"):
        save_frame(tmp_path, kind, number, CLAMP)
    assert not (tmp_path / FILE).exists()
    save_frame(tmp_path, kind, most, CLAMP)
    with pytest.raises(ConfigError, match=rf"{kind} frame 1 .* has {most} \(clamp\)"):
        find_frames(tmp_path).find(kind, 1)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("letter", LETTERS)
def test_frames_differ_by_hundredths_and_not_by_thousandths(letter: str, sign: float) -> None:
    """Of a millimetre or a degree, to either side: controllers print thousandths."""
    ours = FrameTable({"uframe_1": TaughtFrame("box", (4.0, 5.0, 6.0), (0.0, 0.0, 90.0))}, {})
    for more, told in ((0.002, 0), (0.02, 1)):
        numbers = [4.0, 5.0, 6.0, 0.0, 0.0, 90.0]
        numbers[LETTERS.index(letter)] += sign * more
        for turns in (-360.0, 0.0, 360.0):
            theirs = (*numbers[:3], *(angle + turns for angle in numbers[3:]))
            found = list(frame_differences({("user", 1): theirs}, ours, "robot"))
            assert len(found) == told, (theirs, found)


def test_of_somebodys_frames_those_that_differ_are_written_and_counted(tmp_path: Path) -> None:
    """By the name that they have here; one that is known already is none of them."""
    save_frame(tmp_path, "user", 1, CLAMP)
    save_frame(tmp_path, "user", 2, TaughtFrame("box", (4.0, 5.0, 6.0)))
    ours = find_frames(tmp_path)
    theirs = {("user", 1): ours.find("user", 1).numbers, ("user", 2): (7.0, *(0.0,) * 5)}
    assert save_theirs(tmp_path, theirs, ours) == 1
    found = find_frames(tmp_path)
    assert found.find("user", 1) == ours.find("user", 1)
    assert found.find("user", 2) == TaughtFrame("box", (7.0, 0.0, 0.0))
    assert save_theirs(tmp_path, theirs, found) == 0


def test_a_kind_that_a_robot_shows_as_zeros_is_not_written_over_taught_ones(
    tmp_path: Path,
) -> None:
    """A slot that is not there reads 0; a file says so, and what never had numbers loses none."""
    save_frame(tmp_path, "tool", 1, CLAMP)
    ours, before = find_frames(tmp_path), (tmp_path / FILE).read_bytes()
    nothing = (0.0,) * 6
    theirs = {("user", 1): (7.0, *nothing[1:]), ("tool", 1): nothing, ("tool", 2): nothing}
    with pytest.raises(ConfigError, match=r"all UTOOL of the robot read 0.*slot of \$MNUTOOL"):
        save_theirs(tmp_path, theirs, ours)
    assert (tmp_path / FILE).read_bytes() == before
    assert save_theirs(tmp_path, theirs, ours, from_slots=False) == 2
    assert save_theirs(tmp_path, theirs, NO_FRAMES) == 1
