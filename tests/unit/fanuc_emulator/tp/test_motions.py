"""Motions as the manual has them: corners, times, lines, arcs, frames, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
import pytest
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.arm import Arm
from fanuc_emulator.drives.planner import T1_SPEED, Planner
from fanuc_emulator.tp.executor import ProgramState
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml, shipped
from scara_config import Robot, load_robot
from scara_config.programs.files import read_taught
from scara_config.programs.tp.listing import Indexed
from scara_config.programs.tp.values import Pose

from fanuc_emulator import alarms

FRAMES = "\tUF : 0, UT : {tool},\t\tCONFIG : '{config}',"


def joints(number: int, *values: float) -> str:
    """Return a position in joints: degrees, J3 and the table behind it in mm and degrees."""
    units = ("deg", "deg", "mm", "deg")
    rows = [f"\tJ{k}= {v} {unit}" for k, (v, unit) in enumerate(zip(values, units), start=1)]
    return (
        f"P[{number}]{{\n   GP1:\n\tUF : 0, UT : 1,\n"
        + ",\n".join([*rows, "\tE1= 0 deg"])
        + "\n};\n"
    )


def tip(number: int, *values: float, tool: int = 1, config: str = "") -> str:
    """Return a position of the tool: X Y Z W P R."""
    names = zip("XYZWPR", values)
    rows = [f"\t{name}= {v} {'mm' if name in 'XYZ' else 'deg'}" for name, v in names]
    frames = FRAMES.format(tool=tool, config=config)
    return f"P[{number}]{{\n   GP1:\n{frames}\n" + ",\n".join([*rows, "\tE1= 0 deg"]) + "\n};\n"


EVERY = 8


class Stage:
    """A controller that runs one program to its end, and what its drives were told."""

    def __init__(
        self, config: EmulatorConfig, robot: Robot, folder: Path, lines: Sequence[str], taught: str
    ) -> None:
        numbered = "".join(f"{k:4d}:{line} ;\n" for k, line in enumerate(lines, start=1))
        path = folder / "TEST.LS"
        path.write_text(f"/PROG TEST\n/MN\n{numbered}/POS\n{taught}/END\n")
        self.dt, self._arm = config.dt, Arm(robot)
        program = read_taught(path, robot)
        self.controller = Controller(config, robot, {2: program}, 1.7e9)
        self.controller.write_override(100)
        self.controller.pulse_input("panel_run2")
        self.told: list[tuple[int, np.ndarray]] = []
        for _ in range(20000):
            self.now = self.controller.step()
            told = np.array(self.controller._motion._targets)
            self.told.append((self.now.program_line, told))
            if self.now.program_state is ProgramState.ABORTED:
                break
            if self.now.alarm is not None:
                self.end()
                break

    def end(self) -> None:
        """Go on until the program has ended or is paused, and the robot stands."""
        for _ in range(20000):
            self.now = self.controller.step()
            self.told.append((self.now.program_line, np.array(self.controller._motion._targets)))
            still = not any(self.now.velocities) and self.controller._motion.standing
            if self.now.program_state is not ProgramState.RUNNING and still:
                break

    def seconds(self, line: int) -> float:
        """Return how long a line took [s]."""
        return self.dt * sum(shown == line for shown, _ in self.told)

    def flange(self, line: int) -> np.ndarray:
        """Return where a line led the flange to, each ``EVERY`` steps, shape (n, 4, 4) [mm]."""
        rows = [q for shown, q in self.told if shown == line]
        moved = [q for q, before in zip(rows[1:], rows) if (q != before).any()]
        moved = moved[::EVERY] + moved[-1:]
        poses = np.array([self._arm.pose(q[list(self._arm.columns)]) for q in moved])
        poses[:, :3, 3] *= 1e3
        return poses


@pytest.fixture
def run(
    config: EmulatorConfig, robot: Robot, tmp_path: Path
) -> Callable[[Sequence[str], str], Stage]:
    """Return what runs a program of lines with positions."""
    return partial(Stage, config, robot, tmp_path)


Run = Callable[[Sequence[str], str], Stage]
CORNER = joints(1, 0, 40, -100, 0) + joints(2, 60, 40, -100, 0) + joints(3, 60, 90, -60, 0)


def test_the_higher_cnt_the_earlier_the_next_motion_begins_and_the_rounder_the_corner(
    run: Run,
) -> None:
    """FINE waits for the motors, CNT0 goes through the corner, CNT100 leaves as braking begins."""
    found = []
    corner = np.radians([60.0, 40.0, 0.0, 0.0, 0.0]) + [0.0, 0.0, -0.1, 0.0, 0.0]
    for ends in ("FINE", "CNT0", "CNT25", "CNT50", "CNT100"):
        stage = run(["J P[1] 50% FINE", f"J P[2] 50% {ends}", "J P[3] 50% FINE"], CORNER)
        missed = min(np.abs(q - corner).sum() for _, q in stage.told)
        found.append((stage.seconds(2), missed))
        assert np.allclose(stage.told[-1][1], np.radians([60, 90, 0, 0, 0]) + [0, 0, -0.06, 0, 0])
    times, missed_by = zip(*found)
    assert list(times) == sorted(times, reverse=True) and len(set(times)) == len(times)
    assert missed_by[:2] == (0.0, 0.0) and list(missed_by) == sorted(missed_by)
    # The ramp of the longest axis at 50 % takes v / a, and CNT n saves n % of it.
    joint = stage.controller._motion.axes[0].parameters
    ramp = 0.5 * joint.velocity / joint.program_acceleration
    saved = [times[1] - time for time in times[2:]]
    assert saved == pytest.approx([0.25 * ramp, 0.5 * ramp, ramp], abs=0.006)


def test_in_t1_no_corner_is_rounded(config: EmulatorConfig, robot: Robot, tmp_path: Path) -> None:
    """Two motions at once would be faster than the one that is allowed."""
    slow = msgspec.structs.replace(config, settings=config.settings.turned("T1"))
    lines = ["J P[1] 50% FINE", "J P[2] 50% CNT100", "L P[3] 2000mm/sec CNT100", "J P[1] 50% FINE"]
    stage, arm = Stage(slow, robot, tmp_path, lines, CORNER), Arm(robot)
    corner = np.radians([60.0, 40.0, 0.0, 0.0, 0.0]) + [0.0, 0.0, -0.1, 0.0, 0.0]
    assert min(np.abs(q - corner).sum() for _, q in stage.told) == 0.0
    places = np.array([arm.pose(q[list(arm.columns)])[:3, 3] for _, q in stage.told])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / stage.dt
    assert 0.9 * T1_SPEED < speeds.max() < 1.01 * T1_SPEED


def test_in_t1_a_tool_that_is_selected_keeps_to_250_mm_s_too(
    config: EmulatorConfig, robot: Robot, tmp_path: Path
) -> None:
    """J4 turns it round a flange that stands still."""
    slow = msgspec.structs.replace(config, settings=config.settings.turned("T1"))
    lines = ["PR[5]=P[3]-P[3]", "PR[5,1]=100", "UTOOL[2]=PR[5]", "UTOOL_NUM=2"]
    taught = joints(1, 0, 40, -100, -90) + joints(2, 0, 40, -100, 90) + tip(3, *A, 180, 0, 0)
    stage = Stage(slow, robot, tmp_path, [*lines, "J P[1] 9% FINE", "J P[2] 100% FINE"], taught)
    assert stage.now.alarm is None
    aside = np.array([0.1, 0.0, 0.0, 1.0])
    columns = list(stage._arm.columns)
    tips = np.array([(stage._arm.pose(q[columns]) @ aside)[:3] for _, q in stage.told])
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / stage.dt
    assert 0.9 * T1_SPEED < speeds.max() < 1.01 * T1_SPEED


def test_a_motion_to_pr1_is_as_to_any_other_register(run: Run) -> None:
    """Only the stream goes on to a client's set point: speed, override and HOLD count here."""
    lines = "PR[{0}]=P[1]", "J PR[{0}] 50% CNT50", "J P[2] 50% FINE"
    stage, other = [run([line.format(n) for line in lines], CORNER) for n in (1, 2)]
    told, wanted = [[q for _, q in each.told] for each in (stage, other)]
    assert np.allclose(told, wanted)
    stage.controller.write_setpoint_valid(True)
    stage.controller.write_override(10)
    stage.controller.pulse_input("panel_run2")
    speeds = [stage.controller.step().velocities for _ in range(500)]
    stage.controller.write_input("panel_hold", False)
    stage.end()
    greatest = [axis.parameters.velocity for axis in stage.controller._motion.axes]
    shares = np.abs(speeds).max(axis=0) / greatest
    assert shares.max() == pytest.approx(0.05, rel=0.1)
    assert 0.1 < stage.now.positions[0] < math.radians(59.0)


@pytest.mark.parametrize(("lock", "rounded"), [([], False), (["LOCK PREG"], True)])
def test_a_position_register_is_read_ahead_only_while_it_is_locked(
    run: Run, lock: list[str], rounded: bool
) -> None:
    """Else the motion before it comes to its end, as with CNT0."""
    lines = ["PR[2]=P[3]", *lock, "J P[1] 50% FINE", "J P[2] 50% CNT100", "J PR[2] 50% FINE"]
    stage = run(lines, CORNER)
    corner = np.radians([60.0, 40.0, 0.0, 0.0, 0.0]) + [0.0, 0.0, -0.1, 0.0, 0.0]
    assert (float(min(np.abs(q - corner).sum() for _, q in stage.told)) > 0.01) is rounded
    assert np.allclose(stage.told[-1][1], np.radians([60, 90, 0, 0, 0]) + [0, 0, -0.06, 0, 0])


@pytest.mark.parametrize("line", ["END", "IF R[50]=0,END", "SELECT R[50]=0,ABORT"])
def test_a_program_ends_where_its_last_motion_leads(run: Run, line: str) -> None:
    """The arm has come there first: an end cuts no motion short, behind a condition neither."""
    stage = run(["J P[1] 50% FINE", "J P[2] 50% CNT100", line], CORNER)
    assert stage.now.alarm is None and stage.now.program_state is ProgramState.ABORTED
    assert np.allclose(stage.told[-1][1], np.radians([60, 40, 0, 0, 0]) + [0, 0, -0.1, 0, 0])


@pytest.mark.parametrize("line", ["PR[2]=P[1]", "PR[1,1]=0"])
def test_a_locked_position_register_keeps_its_value(run: Run, line: str) -> None:
    """The program pauses with INTP-128, a client's write is lost, and the end of it unlocks."""
    lines = ["PR[1]=P[2]", "PR[2]=P[3]", "J P[1] 50% FINE", "LOCK PREG", "LOCK PREG", line]
    stage = run([*lines, "J PR[2] 50% FINE"], CORNER)
    memory, places = stage.controller.registers, [Indexed("PR", (1.0,)), Indexed("PR", (2.0,))]
    kept, robot = [memory.read(place) for place in places], stage.told[-1][1]
    seen = []
    for key in ("panel_reset", "panel_start"):
        assert stage.now.alarm is not None
        seen.append(stage.now.alarm.code)
        assert stage.now.program_state is ProgramState.PAUSED and stage.now.program_line == 3
        stage.controller.pulse_input(key)
        stage.controller.write_setpoint([0.0] * 4)
        stage.end()
    assert seen == [alarms.PR_LOCKED, alarms.PR_KEPT]
    assert stage.now.alarm is not None and stage.now.alarm.code is alarms.PR_LOCKED
    assert f"line 6 of TEST: {line}: PR[" in stage.now.alarm.cause
    assert kept == [memory.read(place) for place in places]
    assert np.array_equal(robot, stage.told[-1][1]), "no motion is made twice"
    stage.controller.pulse_input("panel_abort")
    stage.end()
    memory.write(places[0], Pose((0.0,) * 9))


@pytest.mark.parametrize("speed", ["1.2sec", "1200msec", "R[5]sec"])
def test_a_motion_takes_the_time_that_it_is_told(run: Run, speed: str) -> None:
    """J, L and C, in sec or msec; CNT0 ends with the path."""
    for line in (f"J P[2] {speed} CNT0", f"L P[2] {speed} CNT0"):
        value = "R[5]=1200" if "msec" in speed else "R[5]=1.2"
        stage = run([value, "J P[1] 50% FINE", line], ARC)
        assert stage.seconds(3) == pytest.approx(1.2, abs=0.005)


A, VIA, B = np.array([400.0, 200.0, 100.0]), np.array([500.0, 0.0, 60.0]), np.array([400, -200, 60])
ARC = tip(1, *A, 180, 0, 0) + tip(2, *B, 180, 0, 40) + tip(3, *VIA, 180, 0, 0)


@pytest.mark.parametrize("taught", [CORNER, ARC], ids=["joints", "tool"])
def test_a_joint_motion_has_its_part_of_the_greatest_speed(run: Run, taught: str) -> None:
    """From rest to rest: the way by the rate, and the rate by its change; then FINE waits."""
    took = []
    for percent in (25, 50):
        stage = run(["J P[1] 50% FINE", f"J P[2] {percent}% FINE"], taught)
        rows = [q for line, q in stage.told if line == 2]
        axes = [axis.parameters for axis in stage.controller._motion.axes]
        ways = [(abs(way), axis) for way, axis in zip(rows[-1] - rows[0], axes) if way]
        rate = min(0.01 * percent * axis.velocity / way for way, axis in ways)
        change = min(axis.program_acceleration / way for way, axis in ways)
        took.append(stage.seconds(2) - 1.0 / rate - rate / change)
    assert took[0] == pytest.approx(took[1], abs=0.02) and 0.0 < took[0] < 0.5


def test_a_line_is_straight_even_and_at_its_speed(run: Run) -> None:
    """Within a hundredth of a millimetre, turned in step with the way, 200 mm/s between ramps."""
    poses = run(["J P[1] 50% FINE", "L P[2] 200mm/sec FINE"], ARC).flange(2)
    places, way = poses[:, :3, 3], (B - A) / np.linalg.norm(B - A)
    along = (places - A) @ way
    assert np.abs(places - A - np.outer(along, way)).max() < 0.01
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / (EVERY * 0.002)
    middle = speeds[len(speeds) // 4 : -len(speeds) // 4]
    assert middle == pytest.approx(200.0, abs=0.1) and speeds.max() < 200.1
    turn = np.unwrap(np.arctan2(poses[:, 1, 0], poses[:, 0, 0]))
    whole = np.linalg.norm(B - A)
    even = turn[0] + (along - along[0]) / whole * math.radians(40.0)
    assert np.abs(turn - even).max() < 1e-6
    assert places[-1] == pytest.approx(B, abs=1e-6)


@pytest.mark.parametrize("speed", ["300mm/sec", "1800cm/min"])
def test_an_arc_goes_round_through_its_middle(run: Run, speed: str) -> None:
    """Each point as far from the centre as the three that are taught."""
    places = run(["J P[1] 50% FINE", f"C P[3] P[2] {speed} FINE"], ARC).flange(2)[:, :3, 3]
    a, b = VIA - A, B - A
    normal = np.cross(a, b)
    centre = A + np.cross((a @ a) * b - (b @ b) * a, normal) / (2.0 * normal @ normal)
    radius = np.linalg.norm(A - centre)
    assert np.linalg.norm(places - centre, axis=1) == pytest.approx(radius, abs=0.01)
    assert np.abs((places - A) @ normal / np.linalg.norm(normal)).max() < 0.01
    assert np.linalg.norm(places - VIA, axis=1).min() < 3.0
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / (EVERY * 0.002)
    assert np.median(speeds) == pytest.approx(300.0, abs=0.1)


SHIFT = ("PR[4]=P[1]-P[1]", "PR[4,3]=20")
HERE = joints(1, 0, 40, -100, 0)


@pytest.mark.parametrize(
    ("line", "taught", "code", "cause"),
    [
        ("L P[2] 9mm/sec FINE", HERE + tip(2, 700, 0, 99, 180, 0, 0), alarms.NOT_REACHABLE, "53%"),
        ("L P[2] 9mm/sec FINE", HERE + tip(2, 500, 0, 99, 170, 0, 0), alarms.NOT_REACHABLE, "% of"),
        (
            "L P[2] 9mm/sec FINE",
            HERE + joints(2, 0, -40, -100, 0),
            alarms.CONFIG_CHANGE,
            "bent otherwise than its target says",
        ),
        ("L P[1] 9mm/sec FINE", tip(1, 400, 200, 99, 180, 0, 0), alarms.SINGULARITY, "after 0%"),
        (
            "L P[2] 9mm/sec FINE",
            joints(1, 0, 90, -100, 0) + tip(2, 400, 200, -99, 180, 0, 0),
            alarms.POSITION_LIMIT,
            "J3 = -",
        ),
        ("J P[1] 9% FINE", tip(1, 400, 200, 200, 180, 0, 0), alarms.POSITION_LIMIT, "J3 = 40.000"),
        ("J P[1] 9% FINE", tip(1, 900, 0, 99, 180, 0, 0), alarms.NOT_REACHABLE, "no joint"),
        (
            "C P[2] P[1] 9mm/sec FINE",
            HERE + joints(2, 0, 40, -120, 0),
            alarms.NOT_REACHABLE,
            "in a line",
        ),
    ],
)
def test_what_the_tool_cannot_do_is_an_alarm_before_it_moves(
    run: Run, line: str, taught: str, code: alarms.AlarmCode, cause: str
) -> None:
    """Out of reach, of a range, through a singularity, in another configuration."""
    first = ["J P[1] 50% FINE"] if taught.startswith(joints(1, 0)[:34]) else []
    stage = run([*first, line], taught)
    assert stage.now.alarm is not None
    assert stage.now.alarm.code is code and cause in stage.now.alarm.cause
    rows = [q for shown, q in stage.told if shown == len(first) + 1]
    assert np.ptp(rows, axis=0).max() < 1e-12


@pytest.mark.parametrize("ends", ["FINE", "CNT100"])
def test_a_motion_that_was_refused_is_made_when_the_program_goes_on(run: Run, ends: str) -> None:
    """STOP: paused before that line, whose corner is not rounded; RESET and START make it again."""
    places = ["PR[2]=P[1]", "PR[2,3]=400", "PR[3]=P[1]", "PR[3,3]=80", "R[51]=2"]
    lines = [*places, "LOCK PREG", f"L P[2] 200mm/sec {ends}", "L PR[R[51]] 200mm/sec FINE"]
    stage = run(["J P[1] 50% FINE", *lines, "WAIT .1(sec)"], ARC)
    now = stage.now
    assert now.program_state is ProgramState.PAUSED and now.outputs.fault
    assert now.alarm is not None and now.alarm.code is alarms.POSITION_LIMIT
    there = stage.flange(8)[-1, :3, 3] if ends == "FINE" else None
    for mended in (False, True):
        if mended:
            stage.controller.registers.write(Indexed("R", (51.0,)), 3.0)
        for key in ("panel_reset", "panel_start"):
            stage.controller.pulse_input(key)
            stage.end()
        assert (stage.now.alarm is None) is mended
    assert stage.now.program_state is ProgramState.ABORTED
    assert there is None or there == pytest.approx(B, abs=1e-3)
    arm, q = stage._arm, stage.told[-1][1]
    assert 1e3 * arm.pose(q[list(arm.columns)])[:3, 3] == pytest.approx([*A[:2], 80.0], abs=1e-3)


def test_a_user_alarm_pauses_the_program_behind_its_line(run: Run) -> None:
    """RESET and START go on with what follows; the motion before it is not made twice."""
    stage = run(["J P[1] 50% FINE", "R[51]=R[51]+1", "UALM[3]", "J P[2] 50% FINE"], CORNER)
    assert stage.now.alarm is not None and stage.now.alarm.code is alarms.USER_ALARM
    assert stage.now.program_state is ProgramState.PAUSED
    for key in ("panel_reset", "panel_start"):
        stage.controller.pulse_input(key)
        stage.end()
    assert stage.now.alarm is None and stage.now.program_state is ProgramState.ABORTED
    assert stage.now.positions[0] == pytest.approx(math.radians(60.0), abs=1e-6)


@pytest.mark.parametrize(
    ("lines", "place"),
    [
        (["J P[1] 50% FINE"], (400, 200, 100)),
        (["PR[2]=P[1]", "PR[2,1]=PR[2,1]+30", "L PR[2] 300mm/sec FINE"], (430, 200, 100)),
        (["PR[GP1:2]=P[1]", "PR[GP1:2,1]=PR[2,1]+30", "J PR[2] 40% FINE"], (430, 200, 100)),
        (["PR[3]=LPOS", "PR[3,2]=(-50)", "J PR[3] 40% FINE"], (400, -50, 100)),
        ([*SHIFT, "L P[1] 99mm/sec FINE Offset,PR[4]"], (400, 200, 120)),
        (
            ["PR[4]=P[1]-P[1]", "PR[4,6]=30", "L P[1] 99mm/sec FINE Offset,PR[4]"],
            (400, 200, 100),
        ),
        (
            ["PR[4]=P[1]-P[1]", "PR[4,3]=20", "L P[1] 99mm/sec FINE Tool_Offset,PR[4]"],
            (400, 200, 80),
        ),
        (["PR[5]=P[1]-P[1]", "PR[5,1]=50", "UFRAME[3]=PR[5]", "UFRAME_NUM=3"], (400, 200, 100)),
        (
            ["PR[5]=P[1]-P[1]", "PR[5,1]=50", "UFRAME[3]=PR[5]", "UFRAME_NUM=3", "PR[6]=P[1]"]
            + ["L PR[6] 99mm/sec FINE"],
            (450, 200, 100),
        ),
        (
            ["PR[5]=P[1]-P[1]", "PR[5,3]=30", "UTOOL[2]=PR[5]", "UTOOL_NUM=2", "J P[2] 50% FINE"],
            (400, 150, 130),
        ),
        (
            ["PR[5]=P[1]-P[1]", "PR[5,6]=90", "UFRAME[3]=PR[5]", "UFRAME_NUM=3"]
            + ["PR[4]=P[1]-P[1]", "PR[4,1]=50", "J P[3] 50% FINE Offset,PR[4]"],
            (500, 309.8076, 60),
        ),
        (
            ["PR[5]=P[1]-P[1]", "PR[5,5]=180", "UTOOL[2]=PR[5]", "UTOOL_NUM=2", *SHIFT]
            + ["J P[3] 50% FINE Tool_Offset,PR[4]"],
            (500, 259.8076, 80),
        ),
        (
            ["PR[4]=P[1]-P[1]", "PR[4,7]=30", "L P[1] 99mm/sec FINE Offset,PR[4]"],
            (400, 200, 100, 30),
        ),
        (
            ["PR[4]=P[1]-P[1]", "PR[4,7]=(-40)", "J P[3] 50% FINE Offset,PR[4]"],
            (500, 259.8076, 60, -40),
        ),
    ],
)
def test_positions_count_in_their_frames(
    run: Run, lines: list[str], place: tuple[float, ...]
) -> None:
    """P[] and PR[], sums, single numbers, user and tool frames, offsets of joints and table."""
    taught = tip(1, 400, 200, 100, 180, 0, 0) + tip(2, 400, 150, 100, 180, 0, 0, tool=2)
    stage = run(["J P[1] 50% FINE", *lines], taught + joints(3, 0, 60, -100, 0))
    assert stage.now.alarm is None, stage.now.alarm
    # Behind the place, where it is not 0: of the table [deg].
    arm, q = stage._arm, stage.told[-1][1]
    there = 1e3 * arm.pose(q[list(arm.columns)])[:3, 3]
    assert [*there, math.degrees(q[-1])] == pytest.approx([*place, 0.0][:4], abs=1e-3)


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        (["J P[2] 50% FINE"], "UTOOL 2, selected is 1: set UTOOL_NUM"),
        (["UTOOL_NUM=2", "L P[1] 99mm/sec FINE"], "UTOOL 1, selected is 2: set UTOOL_NUM"),
        (["UFRAME_NUM=3", "J P[1] 50% FINE"], "UFRAME 0, selected is 3: set UFRAME_NUM"),
        (["UTOOL_NUM=2", "J P[2] 50% FINE"], ""),
        (["UFRAME_NUM=3", "J P[3] 50% FINE"], ""),
    ],
)
def test_a_position_of_another_frame_than_the_selected_one_is_refused(
    run: Run, lines: list[str], why: str
) -> None:
    """INTP-253, again after RESET and START; positions in joints count in any frame."""
    taught = tip(1, 400, 200, 99, 180, 0, 0) + tip(2, 400, 150, 99, 180, 0, 0, tool=2)
    stage = run(["J P[3] 50% FINE", *lines], taught + joints(3, 0, 40, -100, 0))
    if not why:
        assert stage.now.alarm is None and stage.now.program_state is ProgramState.ABORTED
        return
    stood = stage.now.positions
    for _ in range(2):
        assert stage.now.alarm is not None and stage.now.alarm.code is alarms.FRAME_MISMATCH
        assert why in stage.now.alarm.cause and "of TEST" in stage.now.alarm.cause
        assert stage.now.program_state is ProgramState.PAUSED and stage.now.positions == stood
        for each in ("panel_reset", "panel_start"):
            stage.controller.pulse_input(each)
        stage.end()


@pytest.mark.parametrize(("letter", "side"), [("R", 1.0), ("L", -1.0)])
def test_the_configuration_says_on_which_side_the_elbow_is(
    run: Run, letter: str, side: float
) -> None:
    """J chooses it, whatever is nearer."""
    stage = run(["J P[1] 50% FINE"], tip(1, 400, 0, 100, 180, 0, 0, config=letter))
    assert side * stage.told[-1][1][1] > 0.5


def test_the_arms_kinematics_find_back_from_the_pose(robot: Robot) -> None:
    """For the robot with six axes too."""
    rng = np.random.default_rng(1)
    for each in (robot, load_robot(ROOT / "config" / "robots" / "articulated_six")):
        arm = Arm(each)
        limits = np.array([(each.joints[k].lower, each.joints[k].upper) for k in arm.columns])
        for _ in range(5):
            q = limits[:, 0] + rng.uniform(0.3, 0.45, len(limits)) * np.ptp(limits, axis=1)
            assert arm.solve(arm.pose(q), q + 0.05) == pytest.approx(q, abs=1e-7)


@pytest.mark.parametrize(("word", "letters"), [(None, "RL"), ("right", "LR")])
def test_the_elbows_letter_is_told_by_its_side_and_not_by_its_sign(
    tmp_path: Path, word: str | None, letters: str
) -> None:
    """A maker may count the elbow to the right."""
    path = shipped("robot.yaml")
    if word is not None:
        path = changed_yaml(path, tmp_path, ["joints", 1, "positive"], word) / "robot.yaml"
    planner = Planner(load_robot(path.parent), ())
    none = Pose((0.0,) * 9)
    for q2, letter in zip((0.5, -0.5), letters):
        shown = planner.tip_pose((0.0, q2, -0.1, 0.0, 0.0), none, none).config
        assert shown == f"{letter}, 0, 0, 0"
