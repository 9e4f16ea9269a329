"""A program told beforehand: what it does, and why that cannot always be told."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from fanuc_emulator.drives.planner import joint_pose
from fanuc_emulator.tp.rehearsal import rehearse
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.loader import ConfigError
from scara_config.programs.files import Taught, TaughtPose
from scara_config.programs.steps import GripperStep, MoveStep, PathStep, Step, WaitStep
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program
from scara_config.programs.tp.values import Pose

ROBOT = load_robot(ROOT / "config")
POSITIONS = {
    1: (0.1, 0.2, -0.1, 0.0, 0.0),
    2: (0.3, 0.4, -0.1, 0.0, 0.0),
    3: (0.5, 0.6, -0.1, 0.0, 0.0),
}
TIPS = {4: (400.0, 200.0, 60.0, 180.0, 0.0, 0.0), 5: (450.0, 150.0, 60.0, 180.0, 0.0, 0.0)}


def taught(name: str, lines: Sequence[str]) -> Taught:
    """Return a program of lines: P[1] to P[3] in joints, P[4] and P[5] Cartesian."""
    program = Program(name, tuple(map(read_line, lines)))
    poses = {
        number: TaughtPose(Pose((*values, 0.0, 0.0, 0.0), "R"), 0, 0)
        for number, values in TIPS.items()
    }
    for number, q in POSITIONS.items():
        poses[number] = TaughtPose(joint_pose(ROBOT.joints, q), 0, 0)
    return Taught(flow_of(program, "TEST.LS"), POSITIONS, poses)


def walked(*lines: str, **called: Sequence[str]) -> list[Step]:
    """Return what a program of these lines does, with others that it can call."""
    library = {name: taught(name, each) for name, each in called.items()}
    return list(rehearse(taught("TEST", lines), ROBOT, library))


def waits(*lines: str) -> list[float]:
    """Return how long a program of these lines waits, one after the other."""
    return [step.seconds for step in walked(*lines) if isinstance(step, WaitStep)]


def test_steps_have_the_numbers_of_their_lines_in_every_round() -> None:
    """Remarks and the words of loops take numbers too."""
    lines = ("!twice", "FOR R[51]=1 TO 2", "J P[1] 50% FINE", "FOR R[52]=1 TO 2")
    found = walked(*lines, "J P[2] 20% CNT0", "ENDFOR", "WAIT .5(sec)", "ENDFOR")
    inner = [MoveStep(3, POSITIONS[1], 50.0, True), *[MoveStep(5, POSITIONS[2], 20.0, False)] * 2]
    assert found == [*inner, WaitStep(7, 0.5)] * 2


def test_registers_give_positions_and_speeds() -> None:
    """As the program itself has set them."""
    found = walked("R[1]=2", "R[2]=R[1]*10+5", "J P[R[1]] R[2]% FINE")
    assert found == [MoveStep(3, POSITIONS[2], 25.0, True)]


@pytest.mark.parametrize(
    ("lines", "seconds"),
    [
        (["FOR R[1]=3 DOWNTO 1", "WAIT R[1]", "ENDFOR", "WAIT R[1]"], [3.0, 2.0, 1.0, 1.0]),
        (["FOR R[1]=2 TO 1", "WAIT R[1]", "ENDFOR", "WAIT 9(sec)"], [9.0]),
        (["R[1]=0", "LBL[1]", "R[1]=R[1]+1", "WAIT R[1]", "IF R[1]<3,JMP LBL[1]"], [1, 2, 3]),
        (["F[1]=(ON)", "IF (F[1]) THEN", "WAIT 1(sec)", "ELSE", "WAIT 2(sec)", "ENDIF"], [1.0]),
        (["F[1]=(OFF)", "IF (F[1]) THEN", "WAIT 1(sec)", "ELSE", "WAIT 2(sec)", "ENDIF"], [2.0]),
        (["F[1]=(OFF)", "IF (F[1]) THEN", "WAIT 1(sec)", "ENDIF", "WAIT 2(sec)"], [2.0]),
        (["R[1]=2", "SELECT R[1]=1,R[2]=5", "=2,R[2]=6", "ELSE,R[2]=7", "WAIT R[2]"], [6.0]),
        (["R[1]=3", "SELECT R[1]=1,R[2]=5", "=2,R[2]=6", "ELSE,R[2]=7", "WAIT R[2]"], [7.0]),
        (["R[1]=3", "SELECT R[1]=1,JMP LBL[1]", "WAIT 1(sec)", "LBL[1]", "WAIT 2(sec)"], [1, 2]),
        (["R[1]=1", "SELECT R[1]=1,JMP LBL[1]", "WAIT 1(sec)", "LBL[1]", "WAIT 2(sec)"], [2.0]),
        (["R[1]=(-7) DIV 2", "R[2]=7 MOD 4", "WAIT (R[2]-R[1])(sec)"], [6.0]),
        (["R[1]=5", "R[R[1]]=8", "WAIT R[5]"], [8.0]),
        (["WAIT 1(sec)", "END", "WAIT 2(sec)"], [1.0]),
        (["R[1]=DO[1]", "WAIT R[1]"], None),
    ],
)
def test_branches_and_loops_go_as_the_manual_says(
    lines: list[str], seconds: list[float] | None
) -> None:
    """ENDFOR leaves the counter at its last value; only the case that fits is taken."""
    if seconds is None:
        with pytest.raises(
            ConfigError, match=r"line 1 of TEST: R\[1\]=DO\[1\]: depends on DO\[1\]"
        ):
            waits(*lines)
    else:
        assert waits(*lines) == seconds


def test_the_suction_is_switched_in_the_line_that_waits_for_its_answer() -> None:
    """Without such a line in its own, before anything else."""
    move = ("J P[1] 50% FINE", MoveStep)
    found = walked("RO[1]=ON", "WAIT RI[1]=ON", move[0], "RO[1:suction]=OFF", "WAIT .1(sec)")
    assert [found[0], *found[2:]] == [
        GripperStep(2, True),
        GripperStep(4, False, awaited=False),
        WaitStep(5, 0.1),
    ]
    assert walked("RO[1]=OFF") == [GripperStep(1, False)]
    assert walked("J P[1] 9% CNT0", "RO[1]=OFF")[-1] == GripperStep(2, False)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("WAIT RI[1:vacuum]=ON", GripperStep(2, True)),
        ("WAIT RI[1]=ON AND RO[1]=ON TIMEOUT,LBL[1]", GripperStep(2, True)),
        ("WAIT DI[1]=ON", GripperStep(1, True, awaited=False)),
        ("J P[1] 9% FINE", GripperStep(1, True, awaited=False)),
    ],
)
def test_only_the_answer_of_the_suction_is_a_wait_for_it(line: str, told: GripperStep) -> None:
    """Another input may be on already; what is switched last of all nobody has to wait for."""
    assert walked("RO[1]=ON", line, "LBL[1]")[0] == told


def test_a_loop_that_asks_for_the_answer_waits_for_it_as_well() -> None:
    """By IF and JMP, as older programs do."""
    loop = ("LBL[1]", "IF RI[1]=OFF,JMP LBL[1]", "J P[1] 9% FINE")
    assert walked("RO[1]=ON", *loop)[0] == GripperStep(1, True)


@pytest.mark.parametrize(
    ("asks", "line"),
    [(["WAIT RI[1]=ON"], 3), (["LBL[1]", "IF RI[1]=OFF,JMP LBL[1]"], 1), (["LBL[1]"], 0)],
)
def test_an_answer_that_is_awaited_behind_another_wait_is_told_there(
    asks: list[str], line: int
) -> None:
    """Once where the suction is switched and once more, before the motion that counts on it."""
    found = walked("RO[1]=ON", "WAIT .03(sec)", *asks, "J P[1] 9% FINE", "WAIT RI[1]=ON")
    told = [GripperStep(1, True, awaited=False), WaitStep(2, 0.03)]
    told += [GripperStep(line, True)] if line else []
    assert found[:-1] == told and isinstance(found[-1], MoveStep)


def test_an_input_that_was_waited_for_is_on() -> None:
    """Only with it the program goes on, so what follows can be told."""
    assert waits("WAIT DI[1:docked]=ON", "IF DI[1]=OFF,JMP LBL[1]", "WAIT 1(sec)", "LBL[1]") == [1]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["WAIT DI[1]=OFF"], r"line 1 of TEST: WAIT DI\[1\]=OFF: depends on DI\[1\], which is not"),
        (["IF R[1]=1,JMP LBL[1]", "LBL[1]"], r"line 1 of TEST: .*depends on R\[1\]"),
        (["J PR[1] 50% FINE"], r"line 1 of TEST: .*depends on PR\[1\], which is not known"),
        (["J PR[1] R[2]% CNT100"], r"line 1 of TEST: .*depends on R\[2\], which is not known"),
        (["R[2]=5", "J PR[1] R[2]% CNT100"], r"line 2 of TEST: .*depends on PR\[1\], which is not"),
        (["J P[9] 50% FINE"], r"P\[9\] is not taught, there are P\[4\], P\[5\], P\[1\]"),
        (["L PR[3] 50mm/sec FINE"], r"line 1 of TEST: .*depends on PR\[3\], which is not known"),
        (["L P[4] 50mm/sec FINE Offset,PR[4]"], r"line 1 of TEST: .*depends on PR\[4\]"),
        (["PR[3]=LPOS"], "depends on where the robot stands, which is not known"),
        (["J P[1] 9% FINE", "PR[3]=LPOS"], r"line 2 of TEST: .*depends on UFRAME_NUM"),
        (["OVERRIDE=30%"], "sets the override, which is that of the robot here"),
        (["UALM[3]"], r"UALM\[3\] in line 1"),
        (["LOCK PREG", "PR[2]=P[1]"], r"line 2 of TEST: .*PR\[2\] cannot be set between LOCK PREG"),
        (
            ["UTOOL_NUM=1", "L P[4] 9mm/sec FINE"],
            r"line 2 of TEST: .*P\[4\] was taught with UTOOL 0",
        ),
        (["RUN OTHER"], r"line 1 of TEST: RUN OTHER: unknown"),
        (["WAIT F[1]=ON TIMEOUT,LBL[1]", "LBL[1]"], r"line 1 of TEST: .*depends on F\[1\]"),
        (["J P[1] 50% FINE INC"], "the option INC is not executed"),
        (["J P[1] 500% FINE"], r"a speed of 500 % is outside \]0, 100\]"),
        (["CALL OTHER"], r"line 1 of TEST: CALL OTHER: unknown, there are "),
        (["PAUSE"], "cannot be told beforehand"),
        (["RO[1]=ON", "WAIT RI[1]=OFF"], "nothing that the program does makes this true"),
        (["LBL[1]", "JMP LBL[1]"], "TEST: 100000 lines do not lead to its end"),
        (["LBL[1]", "WAIT 1(sec)", "JMP LBL[1]"], "TEST: 100000 lines do not lead to its end"),
        (
            ["J P[1] 9% FINE", "J P[2] 9% CNT60", "PR[3]=LPOS"],
            r"line 3 of TEST: .*depends on how far the last motion has come.*: give that motion F",
        ),
        (["J P[1] 9% CNT60", "RO[1]=OFF"], r"line 2 of TEST: RO\[1\]=OFF: .*that motion FINE"),
        (["J P[1] 9% CNT60", "WAIT .1(sec)", "RO[1]=ON"], r"line 3 of TEST: .*that motion FINE"),
        (["RO[1]=PULSE,1sec"], "line 1 of TEST: .*: a pulse of the suction cannot be told befor"),
        (["DO[1]=ON", "DO[1]=PULSE", "R[1]=DO[1]"], r"line 3 of TEST: .*depends on DO\[1\]"),
        (["R[1]=PULSE"], r"line 1 of TEST: .*R\[1\]: DO and RO have pulses"),
        (["R[1]=1/0"], "line 1 of TEST: .*: division by zero"),
        (["IF R[1],JMP LBL[1]", "LBL[1]"], r"depends on R\[1\]"),
        (["R[1]=5", "IF (R[1]),JMP LBL[1]", "LBL[1]"], "5 is neither ON nor OFF"),
        (["R[1]=7", "JMP LBL[R[1]]"], r"line 2 of TEST: JMP LBL\[R\[1\]\]: there is no LBL\[7\]"),
        (["JMP LBL[3]"], r"TEST\.LS: line 1 of TEST: JMP LBL\[3\]: there is no LBL\[3\]"),
        (
            ["F[1]=(OFF)", "R[1]=7", "WAIT F[1]=ON TIMEOUT,LBL[R[1]]"],
            r"line 3 of TEST: .*: there is no LBL\[7\]",
        ),
        (["R[1]=9", "LBL[1]", "R[1]=R[1]*R[1]", "JMP LBL[1]"], "line 3 of TEST: .*: inf is no n"),
        (["LBL[1]", "LBL[1]"], "line 2 of TEST: .*: is no new label"),
        (["R[1]=2.5", "FOR R[2]=1 TO R[1]", "ENDFOR"], "line 2 of TEST: .*: 2.5 is no whole n"),
        (["FOR R[2]=.5 TO 3", "ENDFOR"], "line 1 of TEST: .*: 0.5 is no whole number"),
        (["FOR R[2]=1 TO 3", "R[2]=1.5", "ENDFOR"], "line 3 of TEST: ENDFOR: 1.5 is no whole num"),
        (["ENDIF"], "line 1 of TEST: ENDIF: nothing that it ends has begun"),
        (["FOR R[1]=1 TO 2", "ENDIF"], "line 2 of TEST: ENDIF: nothing that it ends has begun"),
        (["IF (R[1]=1) THEN"], r"line 1 of TEST: .* has no end"),
    ],
)
def test_what_cannot_be_told_is_named_with_its_line(lines: list[str], said: str) -> None:
    """Program, line and reason."""
    with pytest.raises(ConfigError, match=said):
        walked(*lines)


def test_what_runs_beside_may_change_what_a_program_reads() -> None:
    """What such a program does cannot be told."""
    attributes = {"DEFAULT_GROUP": "*,*,*,*,*"}
    other = Program("OTHER", (read_line("R[1]=1"),), (), attributes)
    library = {"OTHER": Taught(flow_of(other, "OTHER.LS"), {})}
    with pytest.raises(ConfigError, match="line 1 of TEST: RUN OTHER: what follows cannot be told"):
        list(rehearse(taught("TEST", ["RUN OTHER"]), ROBOT, library))


def test_a_called_programs_steps_name_it() -> None:
    """With its own lines and arguments; behind it the caller goes on."""
    found = walked(
        "J P[1] 50% FINE", "CALL LIFT(20)", "J P[3] 50% FINE", LIFT=["J P[2] AR[1]% FINE"]
    )
    expected = [
        MoveStep(1, POSITIONS[1], 50.0, True),
        MoveStep(1, POSITIONS[2], 20.0, True, program="LIFT"),
        MoveStep(3, POSITIONS[3], 50.0, True),
    ]
    assert found == expected


def test_a_step_names_the_program_that_its_line_is_in() -> None:
    """Though by then another program is called, or the called one has ended."""
    found = walked(
        "RO[1]=ON", "J P[1] 50% CNT60", "CALL LIFT", LIFT=["J P[2] 9% FINE", "RO[1]=OFF"]
    )
    assert [(step.line, step.program) for step in found] == [
        (1, ""),
        (2, ""),
        (1, "LIFT"),
        (2, "LIFT"),
    ]


@pytest.mark.parametrize(
    ("lines", "corners"),
    [
        (["J P[1] 50% CNT60", "J P[2] 50% FINE"], [60.0, 0.0]),
        (["J P[1] 50% CNT60", "R[1]=2", "L P[4] 90mm/sec CNT20", "WAIT .1(sec)"], [60.0, 20.0]),
        (["J P[1] 50% CNT60", "END"], [0.0]),
        (["R[1]=1", "J P[1] 50% CNT60", "IF R[1]=1,END", "J P[2] 9% FINE"], [0.0]),
        (["R[1]=2", "J P[1] 50% CNT60", "IF R[1]=1,ABORT", "J P[2] 9% FINE"], [0.0, 0.0]),
        (["R[1]=2", "J P[1] 50% CNT60", "SELECT R[1]=1,JMP LBL[1]", "=2,END", "LBL[1]"], [0.0]),
        (["R[1]=2", "J P[1] 50% CNT60", "IF R[1]=1,PAUSE", "J P[2] 9% FINE"], [60.0, 0.0]),
        (["PR[2]=P[4]", "J P[1] 50% CNT60", "L PR[2] 90mm/sec FINE"], [0.0, 0.0]),
        (["PR[2]=P[4]", "LOCK PREG", "J P[1] 50% CNT60", "L PR[2] 90mm/sec FINE"], [60.0, 0.0]),
        (["R[1]=50", "J P[1] 50% CNT60", "J P[2] R[1]% FINE"], [0.0, 0.0]),
        (["R[1]=50", "LOCK PREG", "J P[1] 50% CNT60", "J P[2] R[1]% FINE"], [0.0, 0.0]),
        (["J P[1] 50% CNT60", "J P[2] max_speed FINE"], [60.0, 0.0]),
    ],
)
def test_a_corner_is_rounded_where_the_robot_rounds_it(
    lines: list[str], corners: list[float]
) -> None:
    """What waits for the end of a motion leaves it its corner."""
    named = ["UFRAME_NUM=0", "UTOOL_NUM=0", *lines]
    moves = [step for step in walked(*named) if isinstance(step, MoveStep | PathStep)]
    assert [step.cnt for step in moves] == corners


def test_registers_lead_a_path_where_the_program_puts_it() -> None:
    """LPOS is where the motions so far end; frames and offsets are those that it has set."""
    lines = ("UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 50% FINE", "PR[3]=LPOS", "PR[3,3]=PR[3,3]+20")
    last = walked(*lines, "PR[4]=P[4]-P[4]", "PR[4,1]=5", "L PR[3] 90mm/sec FINE Offset,PR[4]")[-1]
    assert isinstance(last, PathStep)
    target = last.targets[-1]
    assert isinstance(target.place, Pose) and target.offset is not None
    assert target.place.values[2] == pytest.approx(80.0) and target.offset.values[0] == 5.0
    assert target.place.config == "R, 0, 0, 0"


def test_a_motion_from_an_unknown_place_hides_no_later_one() -> None:
    """Where a J to joint positions ends is known, whatever was before it."""
    lines = ("UFRAME_NUM=0", "UTOOL_NUM=0", "L P[4] 90mm/sec FINE", "J P[1] 50% FINE")
    last = walked(*lines, "PR[3]=JPOS", "J PR[3] 20% FINE")[-1]
    assert isinstance(last, PathStep) and last.targets[-1].place == joint_pose(
        ROBOT.joints, POSITIONS[1]
    )


def test_a_wait_that_runs_out_goes_to_its_label() -> None:
    """After $WAITTMOUT, which is 30 s."""
    found = walked(
        "F[1]=(OFF)", "WAIT F[1]=ON TIMEOUT,LBL[1]", "WAIT 9(sec)", "LBL[1]", "WAIT 1(sec)"
    )
    assert found == [WaitStep(2, 30.0), WaitStep(5, 1.0)]
