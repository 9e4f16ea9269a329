"""Arm configurations: their text, and which ones an arm can have."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.loader import ConfigError
from scara_config.programs.configuration import (
    Configuration,
    configuration_fault,
    read_configuration,
    turn_of,
)
from scara_config.programs.files import read_taught

ROBOTS = ROOT / "config" / "robots"


@pytest.mark.parametrize(
    ("text", "letters", "turns", "printed"),
    [
        ("N U T, 0, 0, 0", "NUT", (0, 0, 0), "N U T, 0, 0, 0"),
        ("NUT,0,-1,1", "NUT", (0, -1, 1), "N U T, 0, -1, 1"),
        ("F D B , 0, 0, 0", "FDB", (0, 0, 0), "F D B, 0, 0, 0"),
        ("L, 0, 0, 0", "L", (0, 0, 0), "L, 0, 0, 0"),
        (" R ", "R", (), "R"),
        ("N L U T, 0, 0, 0", "NLUT", (0, 0, 0), "N L U T, 0, 0, 0"),
    ],
)
def test_a_configuration_is_read_and_printed(
    text: str, letters: str, turns: tuple[int, ...], printed: str
) -> None:
    """As controllers print it, with blanks and without."""
    found = read_configuration(text)
    assert found == Configuration(letters, turns) and found.text == printed
    assert read_configuration(printed) == found


@pytest.mark.parametrize(
    "text", ["N N T, 0, 0, 0", "T U N", "X", "R, 0", "R, 0, 0, 0, 0", ", 0", "R 0"]
)
def test_what_is_no_configuration_is_refused(text: str) -> None:
    """A letter that stands nowhere, twice or out of order, and too few numbers."""
    with pytest.raises(ConfigError, match="is no configuration"):
        read_configuration(text)


def test_an_empty_one_tells_nothing() -> None:
    """The arm stays bent as it is."""
    assert read_configuration("  ") is None


@pytest.mark.parametrize(
    ("degrees", "turn"),
    [(0, 0), (179.99, 0), (-179.99, 0), (180, 1), (-180, -1), (539.99, 1), (540, 2), (-540, -2)],
)
def test_turns_are_counted_as_the_controller_counts_them(degrees: float, turn: int) -> None:
    """Half a turn belongs to the next one."""
    assert turn_of(math.radians(degrees)) == turn


@pytest.mark.parametrize(
    ("robot", "text", "fault"),
    [
        ("fanuc_sr6ia", "R, 0, 0, 0", ""),
        ("fanuc_sr6ia", "L, -2, 0, 0", ""),
        ("fanuc_sr6ia", "", ""),
        ("fanuc_sr6ia", "N U T, 0, 0, 0", "this arm has R or L"),
        ("fanuc_sr6ia", "R, 3, 0, 0", "turn 3: joint_4 goes from turn -2 to 2"),
        ("fanuc_sr6ia", "R, 0, 0, 1", "turn 1: number 3 belongs to no joint of this arm"),
        ("articulated_six", "F D B, 0, 0, 1", ""),
        ("articulated_six", "R, 0, 0, 0", "this arm has N or F, U or D, T or B"),
        ("articulated_six", "N U T, 1, 0, 0", "turn 1: joint_4 goes from turn 0 to 0"),
    ],
)
def test_an_arm_has_the_configurations_of_its_kind(robot: str, text: str, fault: str) -> None:
    """A SCARA has an elbow and one joint that goes round; six joints have a wrist."""
    assert configuration_fault(text, load_robot(ROBOTS / robot)) == fault


def test_a_configuration_that_the_arm_cannot_have_is_refused_with_file_and_line(
    tmp_path: Path,
) -> None:
    """Before anything moves."""
    path = tmp_path / "TEST.LS"
    taught = "P[1]{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
    taught += "\tX= 1 mm, Y= 1 mm, Z= 1 mm, W= 0 deg, P= 0 deg, R= 0 deg, E1= 0 deg\n};\n"
    path.write_text(f"/PROG TEST\n/MN\n1:J P[1] 9% FINE ;\n/POS\n{taught}/END\n")
    with pytest.raises(ConfigError) as refused:
        read_taught(path, load_robot(ROBOTS / "fanuc_sr6ia"))
    said = "P[1].CONFIG : 'N U T, 0, 0, 0': this arm has R or L"
    assert str(refused.value) == f"{path}, line 7: {said}"


def test_a_cartesian_position_has_three_external_axes_at_most(tmp_path: Path) -> None:
    """The controller writes no more of them there; one in joints may have all nine axes."""
    table = load_robot(ROBOTS / "fanuc_sr6ia")
    more = [
        msgspec.structs.replace(table.joint("table_joint"), name=f"table_{n}", axis_number=n)
        for n in (6, 7, 8)
    ]
    robot = msgspec.structs.replace(table, joints=[*table.joints, *more])
    path = tmp_path / "TEST.LS"
    others = ", ".join(f"E{n}= 0 deg" for n in (1, 2, 3, 4))
    taught = "P[1]{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'R, 0, 0, 0',\n"
    taught += f"\tX= 1 mm, Y= 1 mm, Z= 1 mm, W= 0 deg, P= 0 deg, R= 0 deg, {others}\n}};\n"
    path.write_text(f"/PROG TEST\n/MN\n1:J P[1] 9% FINE ;\n/POS\n{taught}/END\n")
    said = "E4: a Cartesian position has E1 to E3: teach it in joints"
    with pytest.raises(ConfigError, match=rf"line \d+: P\[1\]\.{said}"):
        read_taught(path, robot)
