"""Random moves beside random zones in virtual time: no zone is entered, no free way is stopped.

The real core, the real stand-in and the real twin; whoever leads; samples stamped up to 2 ms wrong.
Judged by the ground truth of both sides, with kinematics of the tests' own. A few moves by default,
240 with HYPOTHESIS_SEARCH=1, or as many as ZONE_MOVES says from the seed that ZONE_SEED says.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from dataclasses import replace

import msgspec
import pytest
from harness.programs import program_of
from harness.running.thorough import SEARCH, thorough
from harness.scenes.steps import ROBOT
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles, load_files
from harness.zones.moves import Outcome, ZoneCell, wrong_moves
from scara_config import KeepOut
from scara_config.programs.steps import MoveStep
from scara_config.stopping import stops_command

FEW, MANY, EACH = 4, 240, 8
MOVES = int(os.environ.get("ZONE_MOVES", MANY if SEARCH else FEW))
SEED = int(os.environ.get("ZONE_SEED", 1))
SEEDS = range(SEED, SEED + -(-MOVES // EACH))
AT_ONCE = 5
"""Seeds of one test, which has to end in the time that a test has, beside other tests too."""
NUMBER = 7
FIELD_MS = 90.0
"""What the doctor measures of the field plant: robot_doctor/test_stop_trials.py."""
DEEPEST_MM = -12.0
"""Straight down so far the tool stays 20 mm above the zone below the table."""


def braking(files: CellFiles, delay_ms: float) -> CellFiles:
    """Return the files of a cell whose profile says that its robot brakes so late."""
    stopping = msgspec.structs.replace(files.robot.stopping, braking_delay_ms=delay_ms)
    return replace(files, robot=msgspec.structs.replace(files.robot, stopping=stopping))


@pytest.mark.parametrize(("plant", "delay_ms"), [("field", FIELD_MS), *thorough(("ideal", 50.0))])
@pytest.mark.parametrize("first", SEEDS[::AT_ONCE])
def test_no_zone_is_entered_and_no_free_way_is_stopped(
    first: int, plant: str, delay_ms: float
) -> None:
    """A way that keeps the configured clearance is never stopped; no point is ever in a zone.

    A robot with filters and a slower servo has a delay of its own, which doctor --stops measures.
    """
    counts: Counter[str] = Counter()
    wrong: list[tuple[int, int, Outcome]] = []
    files = braking(load_files(ROBOT, plant=plant), delay_ms)
    seeds = range(first, min(first + AT_ONCE, SEEDS.stop))
    for seed in seeds:
        with ZoneCell(seed, files) as cell:
            wrong += [(seed, *each) for each in wrong_moves(cell, min(EACH, MOVES), counts)]
    print(f"{seeds}: {dict(counts)}")
    assert not wrong, wrong
    assert counts["enter"] > 0.2 * counts["moves"], "the zones are not on the ways"


@pytest.mark.thorough
def test_a_robot_that_was_stopped_too_late_says_that_it_stands_in_the_zone() -> None:
    """A profile of a robot that brakes at once: how deep it stands, and what to measure."""
    files, quick = braking(load_files(ROBOT, plant="field"), 10.0), msgspec.structs.replace
    limits = quick(files.controller.cell, slowing_margin_ms=10.0)
    with VirtualCell(replace(files, controller=quick(files.controller, cell=limits))) as cell:
        cell.setup.keep_out = (KeepOut("wall", (300.0, 150.0, -200.0), (700.0, 700.0, 400.0)),)
        cell.connect()
        cell.real.pendant(100.0, cell.files.program_number("TWO_POINT"))
        cell.wait_whatever(lambda: cell.decisions[-1].trigger == "IN_ZONE", 5.0, "IN_ZONE")
        said = re.fullmatch(
            r"the .* stands \d+ mm deep in keep-out zone wall: it brakes later than 10 ms, the "
            rf"profile's braking_delay_ms: {re.escape(stops_command(ROBOT))} measures it",
            cell.why,
        )
        assert cell.mode == "STOPPED" and said is not None, cell.why
        # Whoever ends its program drives it out.
        cell.real.signal("panel_abort", None)
        cell.schedule.run(0.5)
        for command in ("ALIGN", "HOME"):
            assert cell.operate(command).success, cell.why
            cell.schedule.run(0.3)
            cell.wait_still(0.5)
        assert cell.real.truth[-1][1] == pytest.approx(cell.setup.home, abs=1e-3)
        assert [made.trigger for made in cell.decisions].count("IN_ZONE") == 1


@pytest.mark.parametrize(
    ("leader", "speed_percent"),
    [
        ("program", 100.0),
        ("operator", 40.0),
        *thorough(
            *(("program", speed) for speed in (40.0, 60.0, 80.0)),
            *(("operator", speed) for speed in (60.0, 80.0, 100.0)),
        ),
    ],
)
def test_straight_down_towards_a_zone_that_is_not_entered_goes_to_its_end(
    leader: str, speed_percent: float
) -> None:
    """The zone below the table is 20 mm further; a robot that leads is slowed, not stopped."""
    up = (0.0, 0.0, -0.02, 0.0)
    down = (0.0, 0.0, -0.16 + DEEPEST_MM * 1e-3, 0.0)
    step = MoveStep(1, (*down[:3], 0.0, 0.0), speed_percent, True)
    files = replace(load_files(ROBOT), programs={NUMBER: program_of("DOWN", [step])})
    with VirtualCell(files) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.3)
        assert cell.operate("MOVE_JOINTS", target=up, speed_percent=50.0).success
        cell.wait_still(0.5)
        decided = len(cell.decisions)
        if leader == "program":
            cell.real.pendant(100.0, NUMBER)
        else:
            assert cell.operate("MOVE_JOINTS", target=down, speed_percent=speed_percent).success
        cell.schedule.run(0.3)
        cell.wait_still(0.5)
        stops = [made.why for made in cell.decisions[decided:] if made.trigger == "KEEP_OUT"]
        assert not stops, stops
        assert cell.real.truth[-1][1] == pytest.approx(down, abs=1e-4)


def test_a_jog_towards_a_zone_is_slowed_all_the_way_to_it() -> None:
    """The cap falls as the zone comes nearer, in its clearance too; neither side enters."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.3)
        assert cell.operate("MOVE_JOINTS", target=(0.0, 0.0, -0.1, 0.0)).success
        cell.wait_still(0.5)
        begun, fastest = cell.schedule.now, 0.1 * cell.setup.velocity[2]
        while cell.mode != "STOPPED" and cell.schedule.now < begun + 5.0:
            cell.twin.jog(["joint_3"], [-fastest])
            cell.schedule.run(0.05)
        assert cell.mode in ("STOPPED", "IDLE"), cell.why
        surface = cell.setup.keep_out[0].upper_mm[2] * 1e-3
        clearance = surface + cell.setup.config.cell.keep_out_clearance_mm * 1e-3
        way = [(0.16 + q[2], abs(qdot[2])) for at, q, qdot in cell.twin.truth if at > begun]
        assert max(speed for _, speed in way) > 0.95 * fastest
        near = [speed for height, speed in way if height < clearance]
        assert near and max(near) < 0.2 * fastest
        cell.schedule.run(0.5)
        for side in (cell.real, cell.twin):
            assert min(0.16 + q[2] for _, q, _ in side.truth) > surface
