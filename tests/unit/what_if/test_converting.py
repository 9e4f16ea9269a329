"""Positions of a program in joints and where the tool is: the same motions either way."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import PyKDL
import pytest
from harness.kdl_chain import KdlChain
from harness.running.thorough import examples
from harness.workspace import ROOT
from scara_config import ConfigError, Robot, load_robot
from scara_config.frames import FrameTable, TaughtFrame, frame_differences
from scara_config.programs.files import (
    axis_names,
    is_cartesian,
    joint_values,
    read_listing,
    taught_of,
)
from scara_config.programs.frame_remarks import LONGEST, told_frames
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position, Program, Remark
from scara_config.programs.tp.printer import print_line, print_program
from scara_config.programs.tp.reader import read
from typer.testing import CliRunner
from what_if.convert_node import app
from what_if.converting import EXACT, Form, converted
from what_if.errors import WhatIfError
from what_if.what_if_node import WhatIfServer

from scara_msgs.srv import ConvertProgramRequest
from what_if import converting, what_if_node

ROBOTS = ["articulated_six", "epson_gx4", "fanuc_sr3ia", "fanuc_sr6ia", "scara_4axis"]
TABLE = FrameTable(
    {
        "uframe_1": TaughtFrame("pallet", (50.0, -450.0, -40.0)),
        "uframe_2": TaughtFrame("tilted", (-1234.567, 111.125, 20.5), (3.25, -7.5, 101.0)),
    },
    {"utool_2": TaughtFrame("long", (12.5, -3.0, 60.0), (0.0, 0.0, 45.0))},
)
PROGRAMS = examples(12, 200)
"""Of each robot."""


def robot_of(name: str, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """Return a robot of config/."""
    monkeypatch.setenv("SCARA_ROBOT", name)
    return load_robot(ROOT / "config")


def position(
    robot: Robot, number: int, values: Sequence[float], frames: tuple[str, str] = ("0", "1")
) -> Position:
    """Return a position of joints [rad or m], in robot.yaml's order."""
    given = dict(zip((joint.name for joint in robot.joints), values))
    coordinates = tuple(
        Coordinate(name, round(given[joint.name] / joint.scale, 6), joint.unit)
        for name, joint in axis_names(robot).items()
    )
    return Position(number, "", (GroupPosition(1, *frames, "", coordinates),))


def at_random(robot: Robot, seed: random.Random) -> Program:
    """Return a program of one to six motions to places within the joints' ranges."""
    count = seed.randint(1, 6)
    places = [
        [joint.lower + seed.random() * (joint.upper - joint.lower) for joint in robot.joints]
        for _ in range(count)
    ]
    tool = seed.choice(["0", "1", "2"])
    frames = (seed.choice(["0", "1", "2"]), tool)
    kinds = [seed.choice(["J P[{}] 50% FINE", "L P[{}] 100mm/sec CNT50"]) for _ in range(count)]
    lines = tuple(read_line(kind.format(k)) for k, kind in enumerate(kinds, start=1))
    made = (position(robot, k, place, frames) for k, place in enumerate(places, start=1))
    return Program("RANDOM", lines, tuple(made))


class Second:
    """KDL's word on where the flange is."""

    def __init__(self, robot: Robot) -> None:
        """Follow all joints of the arm, its wrist as its maker counts it."""
        self._columns = [k for k, each in enumerate(robot.joints) if each.screw_axis is not None]
        home = np.array(robot.home_pose)
        if robot.geometry is not None:
            home[:3, :3] = np.diag((1.0, -1.0, -1.0))
        self._chain = KdlChain([robot.joints[k] for k in self._columns], home)

    def flange(self, q: Sequence[float]) -> PyKDL.Frame:
        """Return the flange in the base [mm]."""
        pose = self._chain.pose([q[k] for k in self._columns])
        turn = PyKDL.Rotation(*pose[:3, :3].ravel().tolist())
        return PyKDL.Frame(turn, PyKDL.Vector(*(1e3 * pose[:3, 3]).tolist()))


def frame_of(numbers: Sequence[float]) -> PyKDL.Frame:
    """Return X Y Z W P R by KDL [mm]."""
    x, y, z, w, p, r = numbers
    return PyKDL.Frame(PyKDL.Rotation.RPY(*map(math.radians, (w, p, r))), PyKDL.Vector(x, y, z))


def taught_frame(kind: str, number: str) -> PyKDL.Frame:
    """Return a frame of the table; what it lacks is all 0."""
    known = TABLE.numbered(kind).get(int(number))  # type: ignore[arg-type]
    return frame_of(known.numbers) if known else PyKDL.Frame()


@pytest.mark.parametrize("name", ROBOTS)
def test_positions_come_back_from_where_the_tool_is(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Random programs: out as text in a frame, in again; KDL says the same of each place."""
    robot = robot_of(name, monkeypatch)
    second = Second(robot)
    asked = told = 0
    for seed in range(PROGRAMS):
        dice = random.Random(seed)
        program = at_random(robot, dice)
        frame = dice.choice([None, 0, 1, 2])
        out, _ = converted(program, robot, TABLE, "cartesian", frame)
        text = print_program(out)
        again = read(text, "RANDOM")
        assert again.positions == out.positions and again.lines == out.lines
        taught_of(again, robot, "RANDOM")
        back, _ = converted(again, robot, TABLE, "joints")
        assert not any(map(is_cartesian, back.positions))
        for old, there, new in zip(program.positions, again.positions, back.positions):
            q = joint_values(old, robot)
            apart = [
                abs(a - b) / joint.scale
                for a, b, joint in zip(q, joint_values(new, robot), robot.joints)
            ]
            assert max(apart) <= EXACT, f"program {seed}, P[{old.number}]"
            asked += 1
            if not is_cartesian(there):
                continue
            told += 1
            group = there.groups[0]
            shown = frame_of([each.value or 0.0 for each in group.coordinates[:6]])
            wanted = second.flange(q) * taught_frame("tool", group.tool)
            assert PyKDL.Equal(taught_frame("user", group.frame) * shown, wanted, 1e-4)
    assert told > 0.9 * asked


def program(*texts: str, frames: tuple[str, str] = ("0", "1")) -> Program:
    """Return a program of lines with two positions of joints."""
    robot = load_robot(ROOT / "config")
    first = position(robot, 1, (0.5, 0.7, -0.1, 0.2, 0.0), frames)
    second = position(robot, 2, (-0.5, -0.7, -0.05, 7.0, 0.3), frames)
    return Program("MINE", tuple(map(read_line, texts)), (first, second))


def lines_of(made: Program) -> list[str]:
    """Return the lines as the robot shows them."""
    return [print_line(line).strip() for line in made.lines]


def test_exported_program_selects_its_frames_and_tells_them() -> None:
    """A robot stops at positions of another frame than the one selected; remarks are short."""
    robot = load_robot(ROOT / "config")
    moves = ("J P[1] 50% FINE", "L P[2] 100mm/sec FINE")
    found, _ = converted(program(*moves, frames=("0", "2")), robot, TABLE, "cartesian", 2)
    lines = lines_of(found)
    assert lines[:4] == ["UFRAME_NUM=2", "UTOOL_NUM=2", *moves]
    assert [[group.config for group in each.groups] for each in found.positions] == [
        ["R, 0, 0, 0"],
        ["L, 1, 0, 0"],
    ]
    assert all(len(each.text) <= LONGEST for each in found.lines if isinstance(each, Remark))
    told = told_frames(read(print_program(found), "MINE"))
    assert told == {
        ("user", 2): (-1234.567, 111.125, 20.5, 3.25, -7.5, 101.0),
        ("tool", 2): (12.5, -3.0, 60.0, 0.0, 0.0, 45.0),
    }
    assert list(frame_differences(told, TABLE, "file")) == []
    again, _ = converted(found, robot, TABLE, "cartesian", None)
    assert again == found


def test_frames_that_differ_are_told_with_both_numbers() -> None:
    """By more than a hundredth; a whole turn is none; what was never taught is all 0."""
    theirs = {
        ("user", 1): (50.0, -450.02, -40.0, 0.0, 360.0, 0.0),
        ("user", 2): (-1234.57, 111.13, 20.5, 3.25, -7.5, -259.0),
        ("user", 3): (0.0,) * 6,
        ("tool", 1): (0.0, 0.0, 120.5, 0.0, 0.0, 0.0),
    }
    assert list(frame_differences(theirs, TABLE, "robot")) == [
        "UFRAME[1] (pallet): robot X 50 Y -450.02 Z -40 P 360; here X 50 Y -450 Z -40",
        "UTOOL[1]: robot Z 120.5; here never taught",
    ]


MOVE = "L P[1] 100mm/sec FINE"
REFUSED: list[tuple[tuple[str, ...], Form, int | None, str]] = [
    (("PR[3]=P[1]", MOVE), "joints", None, r"line 1 of MINE: PR\[3\]=P\[1\]: reads the numbers"),
    (("UFRAME[2]=PR[1]", MOVE), "cartesian", None, "sets a frame while it runs"),
    (("PR[3]=LPOS", MOVE), "cartesian", 1, r"line 1 of MINE: .*: leave the positions in UF 0"),
    ((f"{MOVE} Offset,PR[2]",), "cartesian", 1, "counts in the frame that is selected"),
    (("UFRAME_NUM=0", MOVE), "cartesian", 1, "counts in the frame that is selected"),
    (("UFRAME_NUM=2", MOVE), "cartesian", 0, "line 2 of MINE: .*to UFRAME 0, selected is 2"),
    (("UFRAME_NUM=2", "LBL[1]", MOVE), "cartesian", None, "line 3 .*to UFRAME 0, selected is 2"),
    (("UTOOL_NUM=2", "WAIT .1(sec)", MOVE), "cartesian", None, "to UTOOL 1, selected is 2"),
    ((MOVE,), "cartesian", 7, r"user frame 7 was never taught: frames.yaml has 1 \(pallet\), 2"),
]


@pytest.mark.parametrize(("texts", "form", "frame", "why"), REFUSED)
def test_program_whose_lines_would_mean_something_else_is_refused(
    texts: tuple[str, ...], form: Form, frame: int | None, why: str
) -> None:
    """The text names the line."""
    with pytest.raises((WhatIfError, ConfigError), match=why):
        converted(program(*texts), load_robot(ROOT / "config"), TABLE, form, frame)


@pytest.mark.parametrize(
    "texts",
    [
        ("UFRAME_NUM=2", "UFRAME_NUM=0", MOVE),
        ("UFRAME_NUM=0", "LBL[1]", MOVE, "UFRAME_NUM=2"),
        ("UFRAME_NUM=R[1]", MOVE),
        ("UFRAME_NUM=2", "CALL SUB", MOVE),
        ("UFRAME_NUM=2", "J P[R[1]] 50% FINE"),
    ],
)
def test_program_that_may_have_selected_the_frame_is_told_otherwise(texts: tuple[str, ...]) -> None:
    """What the lines leave open is not refused."""
    found, kept = converted(program(*texts), load_robot(ROOT / "config"), TABLE, "cartesian")
    assert kept == () and lines_of(found)[: len(texts) + 1] == ["UTOOL_NUM=1", *texts]


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("R, 0, 0, 0", "R", r"P\[1\]: CONFIG : 'R': where the joints go depends"),
        ("X = ", "X = 9", r"P\[1\]: .*no joint positions bring the tool there"),
        ("UF : 0", "UF : F", r"P\[1\]: UF : F, UT : 1: no number tells its frame"),
        ("UF : 0", "UF : 5", "user frame 5 was never taught"),
    ],
)
def test_place_that_the_joints_cannot_be_told_of_is_refused(old: str, new: str, why: str) -> None:
    """Nothing is guessed."""
    robot = load_robot(ROOT / "config")
    text = print_program(converted(program(MOVE), robot, TABLE, "cartesian")[0])
    assert old in text
    with pytest.raises((WhatIfError, ConfigError), match=why):
        converted(read(text.replace(old, new, 1), "MINE"), robot, TABLE, "joints")


@pytest.mark.parametrize("turn", [0.7, -0.7])
def test_a_joint_at_zero_is_told_without_a_sign(turn: float) -> None:
    """A search ends a little to either side of it; -0 would puzzle a reader of the program."""
    robot = load_robot(ROOT / "config")
    places = [
        (0.0, turn, -0.1, 0.0, 0.0),
        (turn, turn, -0.1, -turn, 0.0),
        (-turn, turn, 0.0, 0.0, 0.0),
    ]
    for values in places:
        own = Program("MINE", (read_line(MOVE),), (position(robot, 1, values),))
        there, _ = converted(own, robot, TABLE, "cartesian")
        back, _ = converted(there, robot, TABLE, "joints")
        for given in back.positions[0].groups[0].coordinates:
            assert math.copysign(1.0, given.value) == 1.0 or given.value < 0.0
        assert " -.000" not in print_program(back) and "-0.000" not in print_program(back)


def test_place_where_the_arm_is_stretched_stays_in_joints() -> None:
    """A rounded number would turn the joints far there; the article's P1 is such a place."""
    robot = load_robot(ROOT / "config")
    article = read_listing(ROOT / "config/robots/fanuc_sr6ia/programs/ARTICLE.LS")
    found, (kept,) = converted(article, robot, TABLE, "cartesian", 1)
    assert kept.startswith("P[1] stays in joints: the arm is stretched there")
    assert [is_cartesian(each) for each in found.positions] == [False, True, True]
    assert [each.groups[0].frame for each in found.positions] == ["1"] * 3


@pytest.mark.parametrize("turn", [1, -1])
def test_place_whose_numbers_lead_elsewhere_stays_in_joints(
    turn: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A joint that would come back a turn further, either way: it is tried before it is told."""
    solved = converting._Converter._solved

    def further(self: Any, *words: Any) -> tuple[float, ...]:
        q = solved(self, *words)
        return (*q[:3], q[3] + turn * math.tau, *q[4:])

    monkeypatch.setattr(converting._Converter, "_solved", further)
    robot = load_robot(ROOT / "config")
    moves = program("J P[1] 50% FINE", "L P[2] 100mm/sec FINE")
    found, kept = converted(moves, robot, TABLE, "cartesian", 1)
    assert not any(map(is_cartesian, found.positions))
    away = "stays in joints: its 6 digits lead 360 deg or mm away"
    assert kept == (f"P[1] {away}", f"P[2] {away}")


def test_whoever_asks_the_node_gets_an_answer_whatever_has_failed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With the reason, as for a motion that is judged."""

    def failing(*_: object) -> None:
        raise ValueError("nobody has foreseen this")

    monkeypatch.setattr(what_if_node, "converted_text", failing)
    server = WhatIfServer.__new__(WhatIfServer)
    server._cell, server._folder = SimpleNamespace(robot=None), ROOT / "config"  # type: ignore
    answer = server._convert(ConvertProgramRequest(text="", to="joints", frame=-1))
    assert not answer.success
    assert answer.message == "what_if/convert failed: ValueError: nobody has foreseen this"


def test_command_writes_a_program_of_the_files_name_and_never_over_one(tmp_path: Path) -> None:
    """A wrong word, or a file that is there: exit code 2."""

    def run(*words: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, [*words, "--config-dir", str(ROOT / "config")])
        return done.exit_code, done.output

    file = tmp_path / "SPACE.LS"
    code, said = run("ARTICLE", "cartesian", "--frame", "1", "--out", str(file))
    assert code == 0 and "P[1] stays in joints" in said and f"program    {file}" in said
    assert read_listing(file).name == "SPACE"
    code, said = run("TWO_POINT", "joints")
    assert code == 0 and said.startswith("/PROG  TWO_POINT")
    for words, why in (
        (("ARTICLE", "joints", "--out", str(file)), "SPACE.LS: is there already"),
        (("ARTICLE", "joints", "--out", "/missing/X.LS"), "/missing is no folder that can be"),
        (("ARTICLE", "polar"), "to = 'polar': allowed are joints, cartesian"),
        (("NOPE", "joints"), "unknown program 'NOPE': there are ARTICLE"),
    ):
        code, said = run(*words)
        assert code == 2 and why in said
