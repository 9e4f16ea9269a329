"""Printouts of a controller, made up after the form of real ones: each line read, or named."""

from __future__ import annotations

import pytest
from fanuc_kit.judge import missing, proposals, unheard
from fanuc_kit.printouts import Printout, read_printout, value_of
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.set_up.slots import slot_table

CONFIG = ROOT / "config"
ROBOT, LAYOUT = load_robot(CONFIG), load_modbus_map(CONFIG)

IOSTATE = """<html><head><script>var a = 1;</script></head><body>
<PRE>
F Number: F000000
VERSION : HandlingTool
$VERSION: V9.40001      1/2/2026
DATE:     03-JAN-26 04:05

IO STATUS::

DIN[   1]  ON  PART &amp; PALLET
DOUT[  12] OFF
GIN[   1]   17  Recipe
AIN[   1]  2000
UI[   1]  ON  *IMSTP
UI[   2] OFF  *HOLD
UO[   1] OFF  Cmd enabled
GOUT[ 109]24695  Checksum
FLG[   1] OFF                         FLG[ 513]  ON
FLG[   2]  ON  Main running           FLG[ 514] OFF
</PRE></body></html>
"""
CURPOS = """CURRENT ROBOT POSITION::
Group #:  1

CURRENT JOINT POSITION:
Joint   1:     19.62
Joint   2:     79.60
Joint   3:    -18.17
Joint   4:    -98.26

Frame #:   0  Tool #:   1
CURRENT USER FRAME POSITION:
CFG: R, 0, 0, 0
X:      1.00
Y:      2.00

Tool #:   1
CURRENT WORLD POSITION:
CFG: R, 0, 0, 0
X:    281.58
Y:    413.66
Z:    141.83
W:      0.00
P:      0.00
R:      0.96
"""
VERSION = """VERSION INFORMATION::
SOFTWARE:              ID:
LR HandlingTool       7DF5/60
CONFIG::
FEATURE:              ORD NO:
LR HandlingTool       H551
HMI Device (SNPX)     R553
KAREL Run-Time Env    J539

CONFIG2::
DEMO. FEATURE:        ORD NO:

MOTOR::
    GR: AX:     MOTOR ID AND INFO:
     1   1      biSR1/6000 20A H1 DSP1-S1
     1   2      biSR1/6000 20A H2 DSP1-S2
     1   3    biSR0.5/6000 20A H3 DSP1-S3
     1   4    biSR0.4/6000 20A H4 DSP1-S4

SERVO::
GROUP: AXIS:  SERVO PARAM ID:
     1   1    P02.02
"""
POSREG = """[*POSREG*]$POSREG  Storage: SHADOW  Access: RW  : ARRAY[2,4] OF Position Reg
    [1,1] =   'HOME'   Group: 1
  J1 =    10.000 deg   J2 =   -20.500 deg   J3 =      .750 mm
  J4 =   -90.000 deg

    [1,2] =   '' Uninitialized
    [1,3] =   'OVER'
  Group: 1   Config: R, 0, 0, 0
  X:   500.125   Y:  -250.000   Z:   300.500
  W:      .000   P:      .000   R:     -.364
  EXT1:  ******** mm
    [2,1] =   'SLIDE'   Group: 2
  J1 = -1200.500 mm
[*POSREG*]$MAXPREGNUM  Storage: CMOS  Access: RW  : INTEGER = 4
"""
NUMREG = """[*NUMREG*]$NUMREG  Storage: SHADOW  Access: RW  : ARRAY[4] OF Numeric Reg
  [1] = 7  'BEAT'
  [2] = -.250000  ''
  [3] = Uninitialized  ''
  [4] = 1.500000e+01  'SPEED'

[*NUMREG*]$MAXREGNUM  Storage: CMOS  Access: RW  : INTEGER = 4
"""


def system(**changed: str) -> str:
    """Return the variables of a controller that is set up; what is named differs."""
    values = {
        "$SNPX_PARAM.$NUM_MODBUS": "8",
        "$RMT_MASTER": "0",
        "$OPWORK.$UOP_DISABLE": "0",
        "$SHELL_CFG.$USE_ABORT": "TRUE",
        "$SHELL_CFG.$CONT_ONLY": "TRUE",
        "$SHELL_CFG.$JOB_BASE": "0",
        "$SHELL_CFG.$RSR_ENABLE[1]": "TRUE",
        "$SHELL_CFG.$NUM_RSR[1]": "101",
        "$MNUFRAMENUM[1]": "0",
        "$MNUTOOLNUM[1]": "1",
    }
    for number, slot in enumerate(slot_table(LAYOUT), start=1):
        values |= {
            f"$SNPX_ASG[{number}].$ADDRESS": str(slot.address),
            f"$SNPX_ASG[{number}].$SIZE": str(slot.size),
            f"$SNPX_ASG[{number}].$VAR_NAME": f"'{slot.name}'" if slot.name else "Uninitialized",
            f"$SNPX_ASG[{number}].$MULTIPLY": f"{slot.multiply:.6e}",
        }
    values |= changed
    rows = ["[*SYSTEM*]$SNPX_ASG  Storage: CMOS  Access: RW  : ARRAY[80] OF SNPX_ASG_T"]
    for name, value in values.items():
        if "LIMS" in name or "VELLIM" in name:
            array, _, index = name.rpartition("[")
            rows += [
                f"     Field: {array}  ARRAY[9] OF REAL",
                f"      [{index} = {value}",
            ]
        elif name.startswith("$MNU"):
            array, _, index = name.rpartition("[")
            rows += [
                f"[*SYSTEM*]{array}  Storage: SHADOW  Access: RW  : ARRAY[1] OF BYTE",
                f"     [{index} = {value}",
            ]
        elif "." in name:
            rows.append(f"     Field: {name} Access: RW: INTEGER = {value}")
        else:
            rows.append(f"[*SYSTEM*]{name}  Storage: CMOS  Access: RW  : INTEGER = {value}")
    return "\n".join(rows) + "\n"


def read(*texts: str) -> Printout:
    """Read printouts."""
    found = Printout()
    for text in texts:
        read_printout(text, "made up", found)
    return found


def test_each_printout_is_read_whole() -> None:
    """No line is left out in silence."""
    found = read(IOSTATE, CURPOS, VERSION, POSREG, NUMREG, system())
    assert found.unread == []


def test_signals_are_read_in_both_forms() -> None:
    """With a comment or two on a line, also from the web server's page."""
    signals = read(IOSTATE).signals
    assert signals["UI"] == {1: True, 2: False} and signals["UO"] == {1: False}
    assert signals["DIN"] == {1: True} and signals["DOUT"] == {12: False}
    assert signals["GIN"] == {1: 17} and signals["AIN"] == {1: 2000}
    assert signals["FLG"] == {1: False, 513: True, 2: True, 514: False}
    assert signals["GOUT"] == {109: 24695}


def test_values_that_stand_below_their_names_are_read() -> None:
    """A position, a text, an array's elements; a position of joints begins behind its name."""
    found = read(
        "[*SYSTEM*]$BACKUP  Storage: CMOS  Access: RW  : BACKUP_T =\n"
        "   Field: $BACKUP.$TIMES  ARRAY[3] OF STRING[24]\n"
        "      [1] = '21/05/08 02:24'\n      [2] = \n  'later'\n      [3] = Uninitialized\n"
        "   Field: $BACKUP.$BASE Access: RW: POSITION = \n  Group: 1   Config: N D B, 0, 0, 0\n"
        "  X:     1.000   Y:    -.500   Z:     2.000\n  W:      .081   P:     0.000   R:  9.000\n"
        "   Field: $BACKUP.$MOST Access: RW: JOINTPOS9 =   Group: 1\n"
        "  J1 =     5.000 deg   J2 =     6.000 deg \n"
    )
    base = {
        f"$BACKUP.$BASE.{axis}": value for axis, value in zip("XYZWPR", (1, -0.5, 2, 0.081, 0, 9))
    }
    times = {"$BACKUP.$TIMES[1]": "21/05/08 02:24", "$BACKUP.$TIMES[2]": "later"}
    most = {"$BACKUP.$MOST.J1": 5.0, "$BACKUP.$MOST.J2": 6.0}
    assert found.variables == {**times, "$BACKUP.$TIMES[3]": None, **base, **most}
    assert found.unread == []


def test_positions_options_and_registers_are_read() -> None:
    """Joints as they are shown, the pose in the world; what is not initialized is no 0."""
    found = read(CURPOS, VERSION, POSREG, NUMREG)
    assert found.joints == {1: 19.62, 2: 79.6, 3: -18.17, 4: -98.26}
    assert (found.pose["X"], found.pose["Y"], found.pose["R"]) == (281.58, 413.66, 0.96)
    assert found.options["R553"] == "HMI Device (SNPX)" and "J539" in found.options
    assert found.axes == [(1, 1), (1, 2), (1, 3), (1, 4)]
    assert found.registers == {1: 7, 2: -0.25, 3: None, 4: 15.0}
    assert found.positions == {
        1: {"J1": 10.0, "J2": -20.5, "J3": 0.75, "J4": -90.0},
        3: {"X": 500.125, "Y": -250.0, "Z": 300.5, "W": 0.0, "P": 0.0, "R": -0.364},
    }
    assert found.variables["$MAXPREGNUM"] == 4 and found.variables["$POSREG[2,1].J1"] == -1200.5


def test_a_line_that_is_not_understood_is_named() -> None:
    """With its file and number."""
    found = read("IO STATUS::\n\nDIN[   1] PERHAPS\n")
    assert found.unread == ["made up, line 3: DIN[   1] PERHAPS"]
    found = read("ETHERNET::\nHost: a\n\nMOTOR::\n     1   1      biSR1\n")
    assert found.unread == ["made up, line 1: no section that is known: ETHERNET"]
    assert found.axes == [(1, 1)]
    assert read("Shopping list\n").unread == ["made up: no printout that is known"]


@pytest.mark.parametrize(
    ("text", "value"),
    [("'R[1]@1.1'", "R[1]@1.1"), ("Uninitialized", None), ("********", None), ("-.5", -0.5)]
    + [("TRUE", True), ("OFF", False), ("10000", 10000), ("1.000000e+00", 1.0)],
)
def test_a_value_is_what_the_controller_means(text: str, value: object) -> None:
    """Numbers, texts and levels."""
    assert value_of(text) == value


def test_a_controller_that_is_set_up_lacks_nothing() -> None:
    """All that is judged was said."""
    full = IOSTATE.replace("UI[   2] OFF", "UI[   2]  ON") + "".join(
        f"UI[{number:4d}]  ON\n" for number in range(3, 19)
    )
    frames = tool_frames("0.000")
    found = read(system(), frames, VERSION, full.replace("</PRE></body></html>", ""))
    found.signals["UI"] |= dict.fromkeys(range(3, 19), True)
    assert list(missing(LAYOUT, found)) == [] and unheard(found) == []


@pytest.mark.parametrize(
    ("name", "value", "said", "menu"),
    [
        ("$SNPX_PARAM.$NUM_MODBUS", "0", "$NUM_MODBUS is 0", "$SNPX_PARAM > $NUM_MODBUS: 8"),
        ("$RMT_MASTER", "1", "$RMT_MASTER is 1", "$RMT_MASTER: 0"),
        ("$OPWORK.$UOP_DISABLE", "1", "UOP_DISABLE is 1", "Enable UI signals: TRUE"),
        ("$SHELL_CFG.$USE_ABORT", "FALSE", "USE_ABORT is False", "CSTOPI for ABORT: TRUE"),
        ("$SHELL_CFG.$CONT_ONLY", "FALSE", "CONT_ONLY is False", "START for CONTINUE only: TRUE"),
        ("$SHELL_CFG.$NUM_RSR[1]", "0", "NUM_RSR[1] is 0", "RSR1 program number: ENABLE, 101"),
        ("$SHELL_CFG.$JOB_BASE", "100", "JOB_BASE is 100", "Base number: 0"),
        ("$MNUFRAMENUM[1]", "2", "$MNUFRAMENUM[1] is 2", "Frames > User Frame > SETIND: 0"),
        ("$MNUTOOLNUM[1]", "4", "$MNUTOOLNUM[1] is 4", "Frames > Tool Frame > SETIND: 1"),
        ("$SNPX_ASG[3].$ADDRESS", "1001", "slot 3 is POS[0]@27.19 at 1001, 19", "$SNPX_ASG"),
        ("$SNPX_ASG[2].$SIZE", "0", "slot 2 is empty", "$SNPX_ASG"),
        ("$SNPX_ASG[2].$SIZE", "1O0", "slot 2 is damaged: $SIZE = 1O0", "$SNPX_ASG"),
        ("$SNPX_ASG[2].$ADDRESS", "l0983", "slot 2 is damaged: $ADDRESS = l0983", "$SNPX_ASG"),
        ("$SNPX_ASG[2].$MULTIPLY", "O.0", "slot 2 is damaged: $MULTIPLY = O.0", "$SNPX_ASG"),
    ],
)
def test_what_is_not_set_is_named_with_its_menu(
    name: str, value: str, said: str, menu: str
) -> None:
    """One line for each."""
    (line,) = missing(LAYOUT, read(system(**{name: value})))
    assert said in line and menu in line


def tool_frames(z: str) -> str:
    """Return the file of frames: the first tool frame is so far out, the second never set."""
    return (
        "[*SYSTEM*]$MNUTOOL  Storage: SHADOW  Access: RW  : ARRAY[1,10] OF POSITION\n"
        "     [1,1] = \n  Group: 1   Config: N D B, 0, 0, 0\n"
        f"  X:     0.000   Y:     0.000   Z:   {z}\n"
        "  W:     0.000   P:     0.000   R:     0.000\n"
        "     [1,2] = Uninitialized\n"
        "[*SYSTEM*]$MNUFRAMENUM  Storage: SHADOW  Access: RW  : ARRAY[1] OF BYTE\n     [1] = 0\n"
    )


def test_a_tool_frame_that_no_program_sets_is_named_unless_it_is_the_flange() -> None:
    """Cartesian positions are of that tool; the pair's are of joints, so nothing else shows it."""
    found = read(tool_frames("120.500"))
    assert found.unread == [] and found.variables["$MNUFRAMENUM[1]"] == 0
    (line,) = missing(LAYOUT, found)
    assert "$MNUTOOL[1,1] is 0, 0, 120.5, 0, 0, 0" in line and "Tool Frame > DETAIL: all 0" in line
    assert list(missing(LAYOUT, found, tool_is_set=True)) == []
    assert list(missing(LAYOUT, found, leads=False)) == []
    flange = read(tool_frames("0.000"))
    assert list(missing(LAYOUT, flange)) == []
    assert "$MNUTOOL[1,1].X" not in unheard(flange) and "$MNUTOOL[1,1].X" in unheard(read(CURPOS))


def test_the_selected_frames_are_read_of_the_current_position_too() -> None:
    """Of the first group."""
    selected = ("$MNUFRAMENUM[1]", "$MNUTOOLNUM[1]")
    assert [read(CURPOS).variables[name] for name in selected] == [0, 1]
    other = CURPOS.replace("Frame #:   0  Tool #:   1", "Frame #:   3  Tool #:   2")
    lines = list(missing(LAYOUT, read(other, CURPOS)))
    assert ["user frame" in line.lower() for line in lines] == [True, False]
    assert len(lines) == 2


def test_a_robot_that_is_only_followed_needs_less() -> None:
    """One client, and no way to start or stop it."""
    found = read(system(**{"$SNPX_PARAM.$NUM_MODBUS": "1", "$SHELL_CFG.$USE_ABORT": "FALSE"}))
    assert list(missing(LAYOUT, found, leads=False)) == []
    assert len(list(missing(LAYOUT, found))) == 2


def test_what_a_printout_does_not_say_is_not_judged() -> None:
    """But told."""
    found = read(CURPOS)
    assert list(missing(LAYOUT, found)) == []
    assert {"$RMT_MASTER", "options", "UI"} <= set(unheard(found))


def test_a_controller_without_the_option_or_with_few_inputs_is_named() -> None:
    """Neither can be set: one is ordered, the other allocated."""
    found = read(VERSION.replace("R553", "R999"), IOSTATE)
    lines = list(missing(LAYOUT, found))
    assert any("option R553" in line for line in lines)
    assert any("only UI 1, 2 are allocated" in line and "Full" in line for line in lines)
    assert any("UI[2] is off" in line for line in lines)


def test_values_of_robot_yaml_are_proposed() -> None:
    """Limits that differ, in the file's units, and axes without a motor."""
    limits = system(
        **{
            "$PARAM_GROUP[1].$LOWERLIMS[1]": "-1.420000e+02",
            "$PARAM_GROUP[1].$UPPERLIMS[3]": "0.000000e+00",
            "$PARAM_GROUP[1].$JNTVELLIM[2]": "7.200000e+02",
        }
    )
    assert list(proposals(ROBOT, read(VERSION, limits))) == [
        "joints.joint_1.lower_deg: -142   # filed: -148",
        "joints.joint_2.velocity_deg_s: 720   # filed: 700",
        "joints.table_joint: axis 5 has no motor; leave the joint out",
    ]
