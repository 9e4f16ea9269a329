"""A draft is gone through line by line: what it asks for, and what only the robot can do."""

from __future__ import annotations

import pytest
from harness.workspace import ROOT
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import Draft, TeachError, draft_of, empty
from operator_panel.teach.places import position_of
from operator_panel.teach.walk import (
    Act,
    LedEnd,
    LedGrip,
    LedMove,
    LedPause,
    LedUntil,
    Walk,
    motion_above,
    motion_to,
)
from scara_config import load_robot
from scara_config.programs.files import program_files

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


def acts(walk: Walk) -> list[Act]:
    """Return all that is asked for, up to the end."""
    found: list[Act] = []
    while not isinstance(act := walk.run_on(), LedEnd):
        found.append(act)
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
            }
        ),
        LedGrip(True),
        LedUntil(),
        LedPause(0.25),
    ]
    assert found == once * 2


def test_palletise_is_gone_through_to_its_end() -> None:
    """The positions that registers choose are found: nine parts, six motions up and two back."""
    text = program_files(ROOT / "config")["PALLETISE"].read_text(encoding="utf-8")
    found = acts(Walk(draft_of(text, ROBOT), ROBOT))
    assert [sum(isinstance(each, kind) for each in found) for kind in (LedMove, LedGrip)] == [
        72,
        18,
    ]


def test_wait_for_the_vacuum_holds_once_the_gripper_shows_it() -> None:
    """What the robot does not show is not guessed."""
    walk = Walk(pick(), ROBOT, 4)
    assert walk.step() == LedUntil()
    with pytest.raises(TeachError, match=r"line 5: WAIT RI\[1:vacuum\]=ON: only the robot knows"):
        walk.holds()
    walk.closed = False
    assert not walk.holds()
    walk.closed = True
    assert walk.holds()


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("C P[1] P[1] 100mm/sec FINE", "only the robot itself executes it"),
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
    walk = Walk(draft_of(text, ROBOT), ROBOT)
    with pytest.raises(TeachError, match=why):
        walk.run_on()
    assert walk.at == 2


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
    with pytest.raises(TeachError, match="it does not end"):
        Walk(draft_of(text, ROBOT), ROBOT).run_on()


def test_single_motion_is_found_by_its_line_and_by_the_one_below() -> None:
    """Without the lines in between."""
    draft = pick()
    assert motion_to(draft, ROBOT, 2).fields["speed_percent"] == 40.0
    assert [motion_above(draft, line) for line in (7, 4, 3)] == [3, 3, 2]
    with pytest.raises(TeachError, match="no motion stands above"):
        motion_above(draft, 2)
    with pytest.raises(TeachError, match="line 4 is no motion"):
        motion_to(draft, ROBOT, 4)
