"""Programs with lines, arcs, corners, frames and calls: judged as the stand-in executes them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from fanuc_emulator.config import load_emulator
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.arm import Arm
from fanuc_emulator.tp.executor import ProgramState
from fanuc_emulator.tp.rehearsal import rehearse
from harness.yaml_files import CONFIG
from scara_config import KeepOut, Robot
from scara_config.programs.files import ProgramSteps, read_taught
from what_if.cell_files_io import find_program
from what_if.judging import judge
from what_if.timing.learning import rests_of
from what_if.timing.planning import plan
from what_if.verdict import Cause, Outcome
from what_if.world import World

TIPS = {
    1: (420.0, 150.0, 80.0, 180.0, 0.0, 0.0),
    2: (520.0, 0.0, 60.0, 180.0, 0.0, 0.0),
    3: (420.0, -150.0, 80.0, 180.0, 0.0, 40.0),
    4: (300.0, 300.0, 100.0, 180.0, 0.0, 0.0),
}
LINES = (
    "UTOOL_NUM=0",
    "J P[1] 40% FINE",
    "L P[2] 200mm/sec CNT50",
    "L P[3] 250mm/sec CNT100",
    "PR[2]=P[1]-P[1]",
    "PR[2,3]=20",
    "C P[2] P[1] 300mm/sec FINE Offset,PR[2]",
    "CALL LIFT",
    "J P[3] 1.5sec CNT30",
    "WAIT .2(sec)",
    "J P[4] 800msec CNT0",
    "L P[1] 150mm/sec FINE ACC50",
)
LIFT = ("UFRAME_NUM=0", "UTOOL_NUM=0", "PR[3]=LPOS", "PR[3,3]=PR[3,3]+20", "L PR[3] 99mm/sec FINE")


def written(folder: Path, name: str, lines: tuple[str, ...]) -> Path:
    """Write a program with the positions, righty, in the base by the flange."""
    text = "".join(f"{k:4d}:{line} ;\n" for k, line in enumerate(lines, start=1))
    taught = ""
    for number, values in TIPS.items():
        units = ("mm", "mm", "mm", "deg", "deg", "deg")
        rows = [f"\t{axis}= {v} {unit}" for axis, v, unit in zip("XYZWPR", values, units)]
        frames = "\tUF : 0, UT : 0,\t\tCONFIG : 'R, 0, 0, 0',\n"
        taught += f"P[{number}]{{\n   GP1:\n{frames}" + ",\n".join([*rows, "\tE1= 0 deg"])
        taught += "\n};\n"
    path = folder / f"{name}.LS"
    path.write_text(f"/PROG {name}\n/MN\n{text}/POS\n{taught}/END\n")
    return path


def executed(robot: Robot, paths: list[Path]) -> tuple[float, np.ndarray]:
    """Return how long the stand-in runs the first program [s], and where its flange went [m]."""
    config = load_emulator(robot, CONFIG)
    programs = {k: read_taught(path, robot) for k, path in enumerate(paths, start=2)}
    controller = Controller(config, robot, programs, 1.7e9)
    controller.write_override(100)
    controller.pulse_input("panel_run2")
    arm, running, places = Arm(robot), 0, []
    for _ in range(20000):
        shown = controller.step()
        running += shown.program_state is ProgramState.RUNNING
        told = controller._motion._targets
        places.append(arm.pose([told[k] for k in arm.columns])[:3, 3])
        if running and shown.program_state is ProgramState.ABORTED:
            assert shown.alarm is None, shown.alarm
            return running * config.dt, np.array(places)
    raise AssertionError("it does not end")


def judged_way(world: World, motion: ProgramSteps) -> np.ndarray:
    """Return where the tool goes by the judge's legs [m], shape (k, 3)."""
    tree, frame = world.cell.tree, world.cell.tree.index[world.cell.robot.tool_frame]
    ways = [leg.way for leg in plan(world, motion).legs if leg.way is not None]
    rows = [way.at(np.linspace(0.0, way.length, 400)) for way in ways]
    return np.vstack([tree.poses(each)[:, frame, :3, 3] for each in rows])


def apart(places: np.ndarray, way: np.ndarray) -> float:
    """Return the greatest distance of places from a way of points that are near each other."""
    return max(float(np.linalg.norm(way - place, axis=1).min()) for place in places[::10])


def test_a_program_is_judged_on_the_way_that_the_stand_in_takes(
    world: World, tmp_path: Path
) -> None:
    """Lines, arcs, rounded corners, seconds, an offset, ACC and a call: place and time."""
    own = written(tmp_path, "MIXED", LINES)
    lift = written(tmp_path, "LIFT", LIFT)
    robot = world.cell.robot
    library = {"LIFT": read_taught(lift, robot)}
    steps = tuple(rehearse(read_taught(own, robot), robot, library))
    motion = ProgramSteps("MIXED", steps)
    verdict = judge(world, motion)
    assert verdict.outcome is Outcome.OK, verdict.sentence
    duration, places = executed(robot, [own, lift])
    start = load_emulator(robot, CONFIG).plant.start_delay_ms * 1e-3
    assert verdict.duration_s == pytest.approx(duration - start, rel=0.01)
    way = judged_way(world, motion)
    # Points of the way are up to 1 mm from each other.
    assert apart(places, way) < 1e-3 and apart(way, places) < 1e-3


def test_nothing_is_learned_of_what_is_refused_or_not_shown(world: World, tmp_path: Path) -> None:
    """A move that the judge thinks impossible, and the lines of a called program."""
    lines = ("UFRAME_NUM=0", "UTOOL_NUM=0", "PR[2]=P[2]", "PR[2,1]=900", "WAIT .1(sec)")
    far = ("J P[1] 40% FINE", "L PR[2] 99mm/sec FINE", "WAIT .1(sec)")
    path = written(tmp_path, "SEEN", (*lines, *far))
    found = find_program(world.cell, str(path), CONFIG)
    seen = [(line, float(line)) for line in (5, 6, 7, 8)]
    assert len(rests_of(world, found, seen)) == 1
    called = tuple(msgspec.structs.replace(step, program="LIFT") for step in found.steps)
    assert rests_of(world, ProgramSteps("SEEN", called), seen) == []
    again = [(1, float(at)) for at in range(4)]
    assert rests_of(world, ProgramSteps("SEEN", called), again) == []


@pytest.mark.parametrize(("aside_mm", "refused"), [(0.0, True), (80.0, False)])
def test_what_is_beside_the_straight_joint_way_is_seen_on_an_arc(
    world: World, tmp_path: Path, aside_mm: float, refused: bool
) -> None:
    """Harm is found where the arc leads, and the line is named."""
    lines = ("J P[1] 40% FINE", "C P[2] P[3] 200mm/sec FINE")
    motion = find_program(world.cell, str(written(tmp_path, "ARC", lines)), CONFIG)
    corner = (535.0 + aside_mm, -20.0, -100.0)
    post = KeepOut("post", corner, (corner[0] + 30.0, 20.0, 300.0))
    near = replace(world, q=(-0.2, 1.3, -0.1, 0.0), zones=(*world.zones, post))
    verdict = judge(near, motion)
    assert (verdict.outcome is Outcome.REFUSED) is refused
    assert not refused or (
        verdict.reasons[0].step == "line 2 of ARC" and "post" in verdict.sentence
    )


@pytest.mark.parametrize(
    ("change", "line", "cause", "said"),
    [
        ("PR[2,1]=900", "L PR[2] 99mm/sec FINE", Cause.REACH, "Position not reachable: after"),
        ("PR[2,3]=400", "J PR[2] 9% FINE", Cause.LIMIT, "Limit error: J3 = 240.000 mm"),
    ],
)
def test_a_motion_that_the_robot_would_refuse_is_refused_with_its_line(
    world: World, tmp_path: Path, change: str, line: str, cause: Cause, said: str
) -> None:
    """By the robot's own planner; what comes behind it is not judged."""
    lines = ("UFRAME_NUM=0", "UTOOL_NUM=0", "J P[1] 40% FINE", "PR[2]=P[2]", change, line)
    path = written(tmp_path, "FAR", lines)
    verdict = judge(world, find_program(world.cell, str(path), CONFIG))
    assert verdict.outcome is Outcome.REFUSED
    (reason,) = verdict.reasons
    assert (reason.cause, reason.step) == (cause, "line 6 of FAR") and said in reason.text
