"""Whole programs of a teach pendant: sections, positions, errors with their place."""

from __future__ import annotations

import msgspec
import pytest
from scara_config.loader import ConfigError
from scara_config.programs.tp.listing import (
    Coordinate,
    GroupPosition,
    Indexed,
    Jump,
    MotionLine,
    Position,
    Unknown,
)
from scara_config.programs.tp.printer import attributes_of, print_program
from scara_config.programs.tp.reader import read

TEXT = """\
/PROG  STACK_2\tMacro
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "two, in a row";
CREATE\t\t= DATE 26-11-25  TIME 08:00:00;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 40,
      TIME_SLICE\t= 0;
DEFAULT_GROUP\t= 1,1,*,*,*;
/APPL
  LINE_TRACK_SCHEDULE_NUMBER      : 0;

/MN
   1:  !Take one ;
   2:   ;
   3:J P[1:over] 50% FINE    ;
   4:C P[2]
    :  P[3] 100mm/sec CNT50    ;
   5:  IF (R[1]=1 OR
    :  R[1]=2),JMP LBL[1] ;
   6:  LBL[1] ;
/POS
P[1:"over"]{
   GP1:
\tUF : 0, UT : 1,\t
\tJ1=   -14.321759156 deg,\tJ2=    69.600 deg,\tJ3=   -60.000  mm,
\tJ4=     0.000 deg,
\tE1=   -90.000 deg
};
P[2]{
   GP1:
\tUF : F, UT : 2,\t\tCONFIG : 'N U T, 0, 0, -1',
\tX =   107.167  mm,\tY =  -868.334  mm,\tZ = ********  mm,
\tW =  -179.998 deg,\tP =      .285 deg,\tR =     0.050 deg
   GP2:
\tUF : 0, UT : 1,\t
\tJ1=  2084.856  mm
};
/END
"""


def test_all_sections_of_a_program_are_read() -> None:
    """A line may go over rows; one without a number belongs to that before it."""
    program = read(TEXT, "STACK_2.LS")
    assert (program.name, program.kind, program.comment) == ("STACK_2", "Macro", "two, in a row")
    assert program.attributes["TASK_PRIORITY"] == "40"
    assert program.attributes["CREATE"] == "DATE 26-11-25  TIME 08:00:00"
    assert program.application == ("  LINE_TRACK_SCHEDULE_NUMBER      : 0;",)
    assert len(program.lines) == 6
    assert isinstance(program.lines[3], MotionLine)
    assert program.lines[4].action == Jump(Indexed("LBL", (1.0,)))


def test_a_row_without_a_number_keeps_what_looks_like_one() -> None:
    """Such a row is no other line: a position's own name stays."""
    (line,) = read("/PROG A\n/MN\nJ P[1:home] 50% FINE ;\n/END\n", "A.LS").lines
    assert line == read("/PROG A\n/MN\n 1:J P[1:home] 50% FINE ;\n/END\n", "A.LS").lines[0]
    assert isinstance(line, MotionLine) and line.targets[0].comment == "home"


@pytest.mark.parametrize("comment", ["first; then", "a, B = 2; C", "", '"'])
def test_a_comment_keeps_its_semicolon(comment: str) -> None:
    """It ends no attribute within quotes; one that is not closed ends with its line."""
    program = read(TEXT.replace("two, in a row", comment), "STACK_2.LS")
    assert program.comment == comment.strip('"')
    assert program.attributes["DEFAULT_GROUP"] == "1,1,*,*,*"
    assert program.attributes["TASK_PRIORITY"] == "40"


def test_positions_keep_frames_groups_units_and_digits() -> None:
    """Joint and Cartesian, one that was not taught, a second motion group."""
    joint, cartesian = read(TEXT, "STACK_2.LS").positions
    assert joint == Position(
        1,
        "over",
        (
            GroupPosition(
                1,
                "0",
                "1",
                "",
                (
                    Coordinate("J1", -14.321759156, "deg"),
                    Coordinate("J2", 69.6, "deg"),
                    Coordinate("J3", -60.0, "mm"),
                    Coordinate("J4", 0.0, "deg"),
                    Coordinate("E1", -90.0, "deg"),
                ),
            ),
        ),
    )
    first, second = cartesian.groups
    assert (first.frame, first.tool, first.config) == ("F", "2", "N U T, 0, 0, -1")
    assert [each.value for each in first.coordinates] == [
        *(107.167, -868.334, None),
        *(-179.998, 0.285, 0.05),
    ]
    assert second == GroupPosition(2, "0", "1", "", (Coordinate("J1", 2084.856, "mm"),))


def test_printed_program_is_read_as_the_same() -> None:
    """With the attributes that every file has; printed again it is the same text."""
    program = read(TEXT, "STACK_2.LS")
    printed = print_program(program)
    again = read(printed, "printed")
    assert again == msgspec.structs.replace(program, attributes=attributes_of(program))
    assert again.attributes["LINE_COUNT"] == "6"
    assert print_program(again) == printed


def test_unknown_line_is_named_with_file_and_number() -> None:
    """Both numbers: that of the file, and that which the pendant shows."""
    text = TEXT.replace("  LBL[1] ;", "  GRIP 1 ;").replace("JMP LBL[1]", "JMP HERE")
    with pytest.raises(ConfigError, match=r"^S\.LS, line 19: line 5 of the program: .*LBL is exp"):
        read(text, "S.LS")
    errors: list[str] = []
    program = read(text, "S.LS", errors)
    assert [error.partition(": '")[0] for error in errors] == [
        "S.LS, line 19: line 5 of the program",
        "S.LS, line 21: line 6 of the program",
    ]
    assert program.lines[4:] == (Unknown("IF (R[1]=1 OR R[1]=2),JMP HERE"), Unknown("GRIP 1"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("/PROG  STACK_2\tMacro", "/PROG", r"S\.LS, line 1: /PROG names no program"),
        ("/PROG", "PROG", r"S\.LS: is no program of a teach pendant: /PROG is missing"),
        ("/MN", "", r"/MN is missing"),
        ("LBL[1] ;\n/POS", "LBL[1]\n/POS", r"line 21: 'LBL\[1\]': has no semicolon at its end"),
        ("   GP2:", "   GROUP 2:", r"line 30: P\[2\], GP1: 'GROUP 2.* is no coordinate"),
        ("UF : 0, UT : 1,\t\n\tJ1=   -", "J1=   -", r"line 23: P\[1\], GP1: UF and UT are exp"),
        ("J3=   -60.000  mm", "J3=   -60.000  in", r"P\[1\], GP1: 'J3= .*' is no coordinate"),
        ("P[2]{", "P2{", r"line 30: .P2.*: is no position"),
        ("};\n/END", "/END", r"line 30: 'P\[2\]\{.*': is no position"),
    ],
)
def test_file_that_is_no_program_is_refused(old: str, new: str, said: str) -> None:
    """The text names the line of the file."""
    assert old in TEXT
    with pytest.raises(ConfigError, match=said):
        read(TEXT.replace(old, new), "S.LS")
