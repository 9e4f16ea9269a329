"""A vehicle that docks beside the robot: its frame is measured, and VEHICLE loads it by that."""

from __future__ import annotations

import math
from itertools import cycle

import msgspec
import numpy as np
import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.gripping.surroundings import Surface
from fanuc_emulator.gripping.vehicle import Docked, dock
from fanuc_emulator.snapshot import Snapshot
from fanuc_emulator.tp.executor import ProgramState
from harness.running.thorough import thorough
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.palletise import MM, load_palletise
from scara_description.taught_frames import user_frame

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)
WORK = load_palletise(CONFIG)
PROGRAMS = load_programs(ROBOT, CONFIG)
NUMBER = next(n for n, program in PROGRAMS.items() if program.name == "VEHICLE")
NEAR, WAITS, OVER, PLACED = 11, 18, 21, 23
"""Lines of VEHICLE: near a part, waiting for a vehicle, over it, down at a place."""


def came(seed: int) -> Docked:
    """Return a vehicle that has docked."""
    docked = dock(WORK, np.random.default_rng(seed))
    assert docked is not None
    return docked


class Loading:
    """The stand-in with VEHICLE started at its pendant."""

    def __init__(self, docked: Docked | None, plant: str = "ideal") -> None:
        config = load_emulator(ROBOT, CONFIG, plant)
        self.dt, self.parts = config.dt, CellParts(WORK, ROBOT)
        chance = np.random.default_rng(1)
        self.robot = Controller(config, ROBOT, PROGRAMS, 1.7e9, self.parts, chance)
        self.robot.write_override(100)
        self.parts.dock(docked)
        for pressed in (True, False):
            self.robot.write_input(f"panel_run{NUMBER}", pressed)
            self.shown = self.robot.step()

    def go(self, seconds: float, line: int = 0) -> Snapshot:
        """Go on for so long, or to a line, or to the end of the program."""
        for _ in range(round(seconds / self.dt)):
            self.shown = self.robot.step()
            ended = self.shown.program_state is ProgramState.ABORTED
            if ended or self.shown.program_line == line:
                break
        return self.shown

    def errors_mm(self, docked: Docked) -> list[float]:
        """Return how far each part lies from its place on the vehicle, as that truly stands."""
        lying = [self.parts.place(part)[:2] for part in self.parts.parts if part.on == "vehicle"]
        x, y = (value * MM for value in WORK.pallet.middle_mm)
        places = [docked.dock.at(px - x, py - y) for px, py in WORK.pallet.places()]
        return [math.dist(at, to) / MM for at, to in zip(lying, places)]


@pytest.mark.parametrize(
    ("seed", "plant"), [(0, "field"), *thorough(*zip(range(1, 50), cycle(("ideal", "field"))))]
)
def test_nine_parts_lie_on_a_vehicle_wherever_it_docked(seed: int, plant: str) -> None:
    """Within the tolerance of palletise.yaml, of its places as it truly stands."""
    docked = came(seed)
    loading = Loading(docked, plant)
    assert loading.go(60.0).program_state is ProgramState.ABORTED
    errors = loading.errors_mm(docked)
    assert len(errors) == 9 and max(errors) <= WORK.task.tolerance_mm
    assert (loading.parts.drops, loading.parts.collisions) == (0, 0)


def test_without_the_measured_frame_parts_miss_their_places() -> None:
    """Where it should have docked is not where it stands."""
    assert WORK.vehicle is not None
    exactly = msgspec.structs.replace(WORK.vehicle, off_mm=0.0, off_deg=0.0)
    told = dock(msgspec.structs.replace(WORK, vehicle=exactly), np.random.default_rng(0))
    docked = came(0)
    loading = Loading(msgspec.structs.replace(docked, frame=told.frame))
    loading.go(60.0)
    assert sum(error > WORK.task.tolerance_mm for error in loading.errors_mm(docked)) == 9


def test_each_vehicle_stands_off_otherwise_and_no_farther_than_its_figures() -> None:
    """Evenly to both sides, along x, along y and turned; its marks are seen off a little too."""
    vehicle, chance = WORK.vehicle, np.random.default_rng(5)
    assert vehicle is not None
    exact = vehicle.dock()
    came = [dock(WORK, chance) for _ in range(300)]
    stands = [docked.dock for docked in came if docked is not None]
    most = (vehicle.off_mm * MM, vehicle.off_mm * MM, math.radians(vehicle.off_deg))
    rows = [(each.x - exact.x, each.y - exact.y, each.turn) for each in stands]
    shares = np.array(rows) / most
    assert np.abs(shares).max() <= 1.0
    assert shares.min(axis=0).max() < -0.9 and shares.max(axis=0).min() > 0.9
    marks = [vehicle.seen(each)[0] for each in stands]
    origins = [docked.frame.values[:2] for docked in came if docked is not None]
    off = np.array(origins) - np.array(marks) / MM
    assert off.std(axis=0) == pytest.approx((vehicle.seen_mm,) * 2, rel=0.2)


def test_the_docks_sensor_measures_the_frame_that_three_taught_points_give() -> None:
    """By another route: the frame of the page, of the same marks."""
    assert WORK.vehicle is not None
    exact = msgspec.structs.replace(WORK.vehicle, seen_mm=0.0)
    docked = dock(msgspec.structs.replace(WORK, vehicle=exact), np.random.default_rng(7))
    marks = [(x, y, WORK.pallet.top_mm * MM) for x, y in exact.seen(docked.dock)]
    taught = user_frame("vehicle", marks)
    assert docked.frame.values[:6] == pytest.approx((*taught.xyz_mm, *taught.wpr_deg))
    assert docked.dock.of(*docked.dock.at(0.03, -0.07)) == pytest.approx((0.03, -0.07))


def test_nothing_is_placed_until_a_vehicle_has_docked() -> None:
    """The robot waits with the first part in hand, and goes on by the frame of who comes."""
    loading, docked = Loading(None), came(3)
    shown = loading.go(30.0)
    assert (shown.program_state, shown.program_line) == (ProgramState.RUNNING, WAITS)
    assert loading.parts.held is not None and loading.parts.held.name == "part_1"
    loading.parts.dock(docked)
    loading.go(60.0)
    assert max(loading.errors_mm(docked)) <= WORK.task.tolerance_mm


def left_under_the_robot() -> Loading:
    """Return the stand-in over a place on a vehicle that has just left."""
    loading = Loading(came(4))
    for line in (OVER, WAITS, OVER, PLACED):
        loading.go(30.0, line)
    loading.parts.dock(None)
    loading.go(0.2)
    return loading


def test_a_vehicle_that_leaves_under_the_robot_holds_it_until_one_has_docked() -> None:
    """Neither RESET alone lets it go, nor START; what the vehicle took along is gone."""
    loading = left_under_the_robot()
    shown = loading.shown
    assert shown.program_state is ProgramState.PAUSED
    assert shown.outputs.held and not shown.outputs.panel_held
    assert [part.name for part in loading.parts.parts] == [f"part_{n}" for n in range(2, 10)]
    still = loading.go(0.5).positions
    for _ in range(2):
        assert shown.outputs.fault and shown.alarm is not None
        assert shown.alarm.cause == "UALM[1] in line 10 of DOCKWTCH"
        for key in ("panel_reset", "panel_start"):
            loading.robot.pulse_input(key)
            shown = loading.go(0.1)
        assert shown.program_state is ProgramState.PAUSED and shown.positions == still
    loading.parts.dock(came(6))
    loading.robot.pulse_input("panel_reset")
    assert not loading.go(0.5).outputs.held and loading.shown.positions == still
    loading.robot.pulse_input("panel_start")
    assert loading.go(60.0).program_state is ProgramState.ABORTED
    assert {part.on for part in loading.parts.parts} == {"vehicle"}


@pytest.mark.parametrize("key", ["cstopi", "panel_abort"])
def test_a_program_that_was_ended_over_a_vehicle_keeps_nobody_waiting_for_one(key: str) -> None:
    """RESET lets the robot go; the watch begins anew with VEHICLE."""
    loading = left_under_the_robot()
    for pressed, held in ((key, True), ("fault_reset", False)):
        loading.robot.pulse_input(pressed)
        shown = [loading.robot.step() for _ in range(100)][-1]
        assert shown.program_state is ProgramState.ABORTED
        assert (shown.outputs.held, shown.outputs.fault) == (held, held)


def test_a_program_that_is_paused_over_a_vehicle_is_watched() -> None:
    """RESET meanwhile ends no watch."""
    loading = Loading(came(4))
    loading.go(30.0, OVER)
    loading.robot.write_input("panel_hold", False)
    loading.robot.write_input("panel_hold", True)
    loading.robot.pulse_input("panel_reset")
    assert loading.go(1.0).alarm is None and not loading.shown.outputs.held
    loading.parts.dock(None)
    assert loading.go(0.1).outputs.fault and loading.shown.outputs.held


def test_a_vehicle_may_leave_while_the_robot_is_at_the_stands() -> None:
    """The program waits for the next one."""
    loading = Loading(came(5))
    for line in (OVER, NEAR):
        loading.go(30.0, line)
    loading.parts.dock(None)
    shown = loading.go(20.0)
    assert not shown.outputs.fault and shown.program_line == WAITS


def test_a_turned_face_carries_what_lies_over_it() -> None:
    """Its corner is farther away than its edge."""
    face = Surface("vehicle", 0.0, (0.1, 0.3), half=(0.1, 0.1), turn=math.radians(45.0))
    assert face.carries(0.1 + 0.13, 0.3)
    assert not face.carries(0.1 + 0.08, 0.3 + 0.08)
