"""STOP, ESTOP and PAUSE on a robot, by how it was set up: each row of docs/operating/stops.md."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
from harness.running.pairs import pairs
from harness.running.thorough import SEARCH, thorough
from harness.scenes.truth import travel
from harness.stops.rows import ALL, COMMANDS, PLANTS, ROBOT, SCENES, SETTINGS, Instant, Row, measure
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files

LATER_S = 0.1
"""The robot stands at most so long after its own ramp has ended."""
AFTER = {"STOP": "STOPPED", "ESTOP": "ESTOP", "PAUSE": "PAUSED"}


FOLLOWED = [scene for scene in SCENES if scene != "twin leads"]
"""With an allocation that is not full no twin leads."""
EACH_TIME = {
    ("full", "real leads", "ideal"),
    ("full", "twin leads", "field"),
    ("full", "in a WAIT", "field"),
    ("simple", "between two moves", "ideal"),
    ("none", "in a WAIT", "field"),
}
"""By day: each scene once, HOLD alone in the one where a next move could begin."""
TRIED = tuple(ALL if SEARCH else pairs(COMMANDS, *SETTINGS))


@functools.lru_cache(maxsize=1)
def rows(instant: Instant) -> tuple[Row, ...]:
    """Return the rows of an instant; the tests of one instant follow each other."""
    return tuple(measure(instant, TRIED))


def found(instant: Instant, command: str) -> list[Row]:
    """Return the rows of one command; each setting was on and off in them."""
    of_it = [row for row in rows(instant) if row.command == command]
    for setting in ("cstopi_for_abort", "imstp_assigned"):
        assert {getattr(row, setting) for row in of_it} == {True, False}
    return of_it


def by_command(uop: str, scenes: Sequence[str]) -> list[Any]:
    """Return each command at the instants of an allocation: each scene on either plant.

    Those of ``EACH_TIME`` each time, the others by ``./cell test --thorough``.
    """
    return [
        pytest.param(
            Instant(uop, scene, plant), command, marks=marks, id=f"{scene}-{plant}-{command}"
        )
        for scene in scenes
        for plant in PLANTS
        for marks in [() if (uop, scene, plant) in EACH_TIME else pytest.mark.thorough]
        for command in COMMANDS
    ]


def stands(instant: Instant, command: str) -> None:
    """Hold the rows of a command to what a stop is: soon, for good, and told."""
    for row in found(instant, command):
        assert row.moved and row.led == (instant.scene == "twin leads"), row
        assert row.stood_s is not None and row.stood_s <= row.ramp_s + LATER_S, row
        assert not row.began and row.program in ("paused", "aborted"), row
        assert row.success and row.mode == AFTER[command], row


@pytest.mark.parametrize(("instant", "command"), by_command("full", SCENES))
def test_the_robot_stands_within_its_ramp_whatever_was_set_up(
    instant: Instant, command: str
) -> None:
    """CSTOPI for ABORT on or off, *IMSTP assigned or not: HOLD works on all.

    The program is paused or gone and no next move begins; the mode is that of the command.
    """
    stands(instant, command)


@pytest.mark.parametrize(("instant", "command"), by_command("simple", FOLLOWED))
def test_hold_alone_stops_a_robot_that_is_only_followed(instant: Instant, command: str) -> None:
    """With the simple allocation HOLD is what is left, and it is enough."""
    stands(instant, command)


@pytest.mark.parametrize(("instant", "command"), by_command("none", FOLLOWED))
def test_a_stop_that_nothing_carries_out_is_no_success(instant: Instant, command: str) -> None:
    """Nothing is allocated: the program runs on, and the answer says so."""
    for row in found(instant, command):
        assert row.moved and row.program == "running", row
        assert not row.success and row.answer == "the real robot is not seen to stand", row
        assert row.mode == "ESTOP", row


@pytest.mark.parametrize(
    ("profile", "uop", "plant"),
    [
        *(("", "simple", "ideal"), ("full", "none", "field")),
        *thorough(("", "none", "field"), ("full", "simple", "ideal")),
    ],
)
def test_a_robot_without_the_signals_of_the_stream_is_never_led(
    profile: str, uop: str, plant: str
) -> None:
    """Without an RSR, or without any input; also where robot.yaml says that it has them."""
    (row,) = measure(Instant(uop, "twin leads", plant, profile), ALL[:1])
    assert not row.moved and not row.led


def test_a_robot_of_which_no_stop_was_tried_is_followed_and_never_led() -> None:
    """The answer names the setting; whoever moves the twin is stopped, and the robot follows not.

    Its own program leads, and STOP stops it as ever.
    """
    files = load_files(ROBOT)
    tried = {"hold": "192.0.2.1"}
    untried = msgspec.structs.replace(files.robot.stopping, uop="full", tried=tried)
    robot = msgspec.structs.replace(files.robot, stopping=untried)
    with VirtualCell(dataclasses.replace(files, robot=robot)) as cell:
        cell.connect()
        refused = cell.operate("HOME")
        assert not refused.success and "robot.yaml: stopping.tried" in refused.message
        assert "stopping.tried" in cell.refusals()["JOG"]
        begun = cell.schedule.now
        cell.twin.move_to.begin(cell.files.robot.positions_m["P2"], 50.0, "", lambda *_: None)
        cell.wait_whatever(lambda: cell.mode == "STOPPED", 2.0, "STOPPED")
        assert cell.decisions[-1].trigger == "TWIN_MOVED_UNLED"
        assert "stopping.tried" in cell.why
        cell.schedule.run(1.0)
        assert travel(cell.real.truth, begun) < 5e-3
        assert cell.operate("ALIGN").success
        cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE")
        cell.real.pendant(50.0, cell.files.program_number("TWO_POINT"))
        cell.wait_whatever(lambda: cell.mode == "REAL_LEADS", 5.0, "REAL_LEADS")
        cell.schedule.run(0.3)
        told = cell.clock()
        assert cell.operate("STOP").success
        cell.schedule.run(1.0)
        assert not cell.unseen(told)
