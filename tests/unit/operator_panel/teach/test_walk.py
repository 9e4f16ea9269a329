"""A draft is gone through line by line: what it asks for, and what only the robot can do."""

from __future__ import annotations

import math

import msgspec
import pytest
from harness.workspace import ROOT
from operator_panel.teach import draft as teach
from operator_panel.teach import walk
from operator_panel.teach.draft import Draft, TeachError, draft_of, empty
from operator_panel.teach.places import position_of
from operator_panel.teach.walk import (
    Act,
    LedMove,
    Walk,
    motion_above,
    motion_to,
)
from scara_config import load_robot
from scara_config.programs.files import program_files
from scara_config.programs.steps import GripperStep, WaitStep
from scara_config.programs.tp.listing import WaitUntil, Word
from scara_control.kinematics.tool_path import MOST_PLACES

ROBOT = load_robot(ROOT / "config")
HOME = {joint.name: 0.0 for joint in ROBOT.joints}


def pick() -> Draft:
    """Return twice: a joint motion, a line, grip, and a wait."""
    draft = empty("PICK", ROBOT)
    draft = teach.recorded(draft, ROBOT, 0, position_of(ROBOT, HOME), "J", 40.0, None)
    draft = teach.recorded(draft, ROBOT, 1, position_of(ROBOT, HOME), "L", 120.0, 50.0)
    draft = teach.gripping(draft, ROBOT, 2, True)
    draft = teach.waiting(draft, ROBOT, 4, 0.25)
    return teach.looped(draft, ROBOT, 1, 5, 2)


def acts(walked: Walk) -> list[Act]:
    """Return all that is asked for, up to the end; steps as if they stood in line 1."""
    found: list[Act] = []
    while not isinstance(act := walked.run_on(), Word):
        numbered = isinstance(act, GripperStep | WaitStep)
        found.append(msgspec.structs.replace(act, line=1) if numbered else act)
    return found


def test_loop_asks_for_each_round_what_its_lines_ask_for() -> None:
    """A line goes straight at its speed, a joint motion at its percent; ends after two rounds."""
    found = acts(Walk(pick(), ROBOT))
    still = [0.0] * len(ROBOT.twin_joints)
    once = [
        LedMove({"joint_positions": still, "speed_percent": 40.0}),
        LedMove(
            {
                "joint_positions": still,
                "speed_percent": 100.0,
                "path": "linear",
                "speed_mm_s": 120.0,
            },
            25.0,
        ),
        GripperStep(1, True),
        pick().program.lines[4],
        WaitStep(1, 0.25),
    ]
    assert found == once * 2 and isinstance(once[3], WaitUntil)


def along(*lines: str) -> list[Act]:
    """Return what lines between three positions ask for."""
    draft = empty("ROUND", ROBOT)
    for degrees in (10.0, 20.0, 30.0):
        there = position_of(ROBOT, HOME | {"joint_1": math.radians(degrees)})
        draft = teach.recorded(draft, ROBOT, 0, there, "J", 40.0, None)
    head, _, rest = draft.text.partition("/MN\n")
    numbered = "".join(f"   {k}:{line} ;\n" for k, line in enumerate(lines, 1))
    text = f"{head}/MN\n{numbered}/POS{rest.partition('/POS')[2]}"
    return acts(Walk(draft_of(text, ROBOT), ROBOT))


def at(*degrees: float) -> list[float]:
    """Return joint positions with the first joint at each of some angles, one after the other."""
    rest = [0.0] * (len(ROBOT.twin_joints) - 1)
    return [value for each in degrees for value in (math.radians(each), *rest)]


def test_motions_with_round_corners_are_one_order() -> None:
    """Each is passed as near as its own CNT asks; what it passes comes in its order."""
    (one,) = along("J P[1] 40% CNT100", "J P[2] 40% CNT20", "J P[3] 40% FINE")
    assert isinstance(one, LedMove)
    assert one.fields["via"] == pytest.approx(at(10.0, 20.0))
    assert one.fields["joint_positions"] == pytest.approx(at(30.0))
    assert (one.fields["corner_mm"], one.corner_mm) == (10.0, 0.0)


@pytest.mark.parametrize(
    "lines",
    [
        ("J P[1] 40% FINE", "J P[2] 40% FINE"),
        ("J P[1] 40% CNT0", "J P[2] 40% FINE"),
        ("J P[1] 40% CNT100", "J P[2] 50% FINE"),
        ("J P[1] 40% CNT100", "L P[2] 100mm/sec FINE"),
        ("L P[1] 100mm/sec CNT100", "L P[2] 200mm/sec FINE"),
        ("C P[1] P[2] 100mm/sec CNT100", "C P[2] P[3] 100mm/sec FINE"),
    ],
)
def test_a_motion_of_another_kind_or_speed_begins_from_rest(lines: tuple[str, str]) -> None:
    """As after FINE: one order has one way and one speed."""
    found = along(*lines)
    assert len(found) == 2
    assert all("corner_mm" not in each.fields for each in found if isinstance(each, LedMove))


def test_a_corner_that_waits_for_the_gripper_is_not_rounded() -> None:
    """What the robot shows then is not known before."""
    lines = ("J P[1] 40% CNT100", "IF RI[1]=ON,JMP LBL[1]", "J P[2] 40% FINE", "LBL[1]")
    walk_to = along(*lines[:1])
    assert isinstance(walk_to[0], LedMove)
    with pytest.raises(TeachError, match="only the robot knows"):
        along(*lines)


def test_an_order_holds_no_more_places_than_the_twin_takes() -> None:
    """The rest is an order of its own."""
    assert walk.MOST_PLACES == MOST_PLACES
    first, second = along(*["J P[1] 40% CNT50", "J P[2] 40% CNT50"] * 9)
    assert isinstance(first, LedMove) and isinstance(second, LedMove)
    assert len(first.fields["via"]) == MOST_PLACES * len(first.fields["joint_positions"])
    assert "via" not in second.fields


def test_an_arc_passes_its_first_position() -> None:
    """C P[n] P[m]."""
    (one,) = along("C P[1] P[3] 100mm/sec FINE")
    assert isinstance(one, LedMove)
    assert (one.fields["path"], one.fields["speed_mm_s"]) == ("circular", 100.0)
    assert one.fields["via"] == pytest.approx(at(10.0))
    assert one.fields["joint_positions"] == pytest.approx(at(30.0))


def test_palletise_is_gone_through_to_its_end() -> None:
    """The positions that registers choose are found: nine parts, six motions up and two back."""
    text = program_files(ROOT / "config")["PALLETISE"].read_text(encoding="utf-8")
    found = acts(Walk(draft_of(text, ROBOT), ROBOT))
    assert [sum(isinstance(each, kind) for each in found) for kind in (LedMove, GripperStep)] == [
        72,
        18,
    ]


def test_wait_for_the_vacuum_holds_once_the_gripper_shows_it() -> None:
    """What the robot does not show is not guessed."""
    walked = Walk(pick(), ROBOT, 4)
    assert isinstance(walked.step(), WaitUntil)
    with pytest.raises(TeachError, match=r"line 5: WAIT RI\[1:vacuum\]=ON: only the robot knows"):
        walked.holds()
    walked.closed = False
    assert not walked.holds()
    walked.closed = True
    assert walked.holds()


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("C P[1] PR[1] 100mm/sec FINE", "only the robot itself executes it"),
        ("J PR[1] 50% FINE", "only the robot itself executes it"),
        ("J P[1] 2.0sec FINE", "only the robot itself executes it"),
        ("L P[1] 100mm/sec FINE ACC50", "only the robot itself executes it"),
        ("J P[1] 50% FINE Offset,PR[1]", "only the robot itself executes it"),
        ("CALL OTHER", "only the robot itself executes it"),
        ("DO[1]=ON", r"only the robot sets DO\[1\]"),
        ("J P[R[7]] 50% FINE", r"only the robot knows R\[7\]"),
        ("IF DI[1]=ON,JMP LBL[1]", r"only the robot knows DI\[1\]"),
    ],
)
def test_line_that_only_the_robot_executes_is_refused_by_its_number(line: str, why: str) -> None:
    """The rest of the program stays as it is."""
    text = pick().text.replace(
        "  FOR R[51:round]=1 TO 2", f"  LBL[1] ;\n   2:{line} ;\n   3:  FOR R[51:round]=1 TO 2"
    )
    walked = Walk(draft_of(text, ROBOT), ROBOT)
    with pytest.raises(TeachError, match=why):
        walked.run_on()
    assert walked.at == 2


def test_frames_that_are_selected_change_nothing_and_another_tools_line_is_refused() -> None:
    """A position tells its frames itself; the flange's line is not that of a tool's tip."""
    selected = "  UFRAME_NUM=2 ;\n   2:  UTOOL_NUM=1 ;\n   3:  FOR R[51:round]=1 TO 2"
    text = pick().text.replace("  FOR R[51:round]=1 TO 2", selected)
    assert acts(Walk(draft_of(text, ROBOT), ROBOT)) == acts(Walk(pick(), ROBOT))
    walk = Walk(draft_of(text.replace("UT : 1", "UT : 2"), ROBOT), ROBOT)
    assert isinstance(walk.run_on(), LedMove)
    with pytest.raises(TeachError, match=r"line 5: L P\[2\] .*the tip of another tool"):
        walk.run_on()


def test_program_without_an_end_is_refused() -> None:
    """A jump to itself."""
    text = pick().text.replace(
        "  FOR R[51:round]=1 TO 2", "  LBL[1] ;\n  2:  JMP LBL[1] ;\n  3:  FOR R[51:round]=1 TO 2"
    )
    with pytest.raises(TeachError, match="2000 lines without a motion or a wait: it does not end"):
        Walk(draft_of(text, ROBOT), ROBOT).run_on()


def test_single_motion_is_found_by_its_line_and_by_the_one_below() -> None:
    """Without the lines in between."""
    draft = pick()
    assert motion_to(draft, ROBOT, 2).fields["speed_percent"] == 40.0
    assert [motion_above(draft, line) for line in (7, 4, 3)] == [3, 3, 2]
    with pytest.raises(TeachError, match="no motion stands above"):
        motion_above(draft, 2)
    first = teach.recorded(empty("A", ROBOT), ROBOT, 0, position_of(ROBOT, HOME), "J", 40.0, None)
    assert motion_above(first, 2) == 1
    with pytest.raises(TeachError, match="line 4 is no motion"):
        motion_to(draft, ROBOT, 4)


@pytest.mark.parametrize("lines", [0, 1])
def test_nothing_is_gone_to_while_no_line_is_chosen(lines: int) -> None:
    """In front of line 1 stands no line; counted backwards, the last one would be gone to."""
    draft, home = empty("A", ROBOT), position_of(ROBOT, HOME)
    for at in range(lines):
        draft = teach.recorded(draft, ROBOT, at, home, "J", 40.0, None)
    with pytest.raises(TeachError, match="no line is chosen"):
        motion_to(draft, ROBOT, 0)
