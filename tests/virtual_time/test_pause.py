"""PAUSE holds both sides and ends the stream, whoever leads; only RESUME moves again.

In virtual time: the real core, the real stand-in and the real twin.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import msgspec
import pytest
from harness.running.thorough import thorough
from harness.scenes.steps import AT_REST_DEG_MM, AWAY, ROBOT, both_stood, go, run_program
from harness.scenes.truth import standstill_since, travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files
from scara_control.motion.commands import Command
from twin_controller.core.events import PersonSeen

JOG_S = 2.0
JOG_PERIOD_S = 0.05


class PausedCell(VirtualCell):
    """A cell with somebody who jogs the twin, and perhaps somebody near the robot."""

    def __init__(self, monitored: bool = False) -> None:
        """Connect."""
        files = load_files(ROBOT)
        separation = msgspec.structs.replace(
            files.controller.separation, enabled=monitored, sensors=("",)
        )
        controller = msgspec.structs.replace(files.controller, separation=separation)
        super().__init__(replace(files, controller=controller))
        self.person = (4.0, 0.0, 0.2)
        if monitored:
            self.schedule.every(0.05, self._see, 0.0023)
        self.connect()

    def _see(self) -> None:
        self.put(PersonSeen(self.clock(), self.person))

    def jog(self, velocity: float = 0.25) -> None:
        """Jog the twin's first joint for two seconds [rad/s]."""
        for _ in range(round(JOG_S / JOG_PERIOD_S)):
            self.twin.jog(["joint_1"], [velocity])
            self.schedule.run(JOG_PERIOD_S)

    def push_twin(self) -> None:
        """Move the twin past everything that may refuse it, for a second."""
        self.twin.simulation.control.command_velocity("joint_1", 0.25)
        self.schedule.run(1.0)
        self.twin.simulation.control.command_velocity("joint_1", 0.0)
        self.schedule.run(0.5)

    def real_went(self, since: float) -> float:
        """Return how far the robot went [deg or mm]."""
        return travel(self.real.truth, since)


@pytest.fixture
def cell() -> Iterator[PausedCell]:
    """Give an idle cell."""
    with PausedCell() as made:
        yield made


def test_a_jog_of_a_paused_twin_is_refused_and_the_same_path_goes_on(cell: PausedCell) -> None:
    """The twin is paused too, whoever commands it; the refusal says how to go on."""
    go(cell, 30.0)
    cell.schedule.run(0.5)
    assert cell.operate("PAUSE").success
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    cell.jog()
    cell.twin.command_velocity("joint_2", 0.3)
    cell.schedule.run(1.0)
    assert "the twin is paused: RESUME or STOP first" in cell.twin.refused[-1]
    assert cell.real_went(rested) < AT_REST_DEG_MM
    assert travel(cell.twin.truth, rested) < AT_REST_DEG_MM
    assert cell.operate("RESUME").success
    cell.wait_until(lambda: cell.mode == "IDLE", 30.0, "the end of the move")


def test_a_twin_that_moves_during_a_pause_is_not_followed_and_the_path_is_gone(
    cell: PausedCell,
) -> None:
    """RESUME says that a side was moved: the path that was paused is gone, the pair is stopped."""
    go(cell, 10.0)
    cell.schedule.run(0.5)
    assert cell.operate("PAUSE").success
    both_stood(cell, cell.schedule.now)
    cell.schedule.run(0.5)
    rested = cell.schedule.now
    cell.push_twin()
    assert cell.real_went(rested) < AT_REST_DEG_MM
    answer = cell.operate("RESUME")
    assert not answer.success and "no longer stands where it was paused" in answer.message
    assert cell.mode == "STOPPED"
    cell.schedule.run(1.5)
    assert cell.real_went(rested) < AT_REST_DEG_MM


def led_by_the_robot_and_paused(cell: PausedCell) -> float:
    """Pause a pair whose robot led, so that the twin's nodes have nothing to pause; return when."""
    run_program(cell)
    cell.schedule.run(0.3)
    assert cell.operate("PAUSE").success
    both_stood(cell, cell.schedule.now)
    cell.schedule.run(0.5)
    return cell.schedule.now


def held_again(cell: PausedCell) -> None:
    """Say that the twin was held once more, once, and the pair is paused as before."""
    (held,) = [made for made in cell.decisions if made.trigger == "TWIN_MOVED_PAUSED"]
    assert held.why == "the twin moved although the pair is paused: it is held again"
    assert cell.mode == "PAUSED"


def test_a_twin_that_somebody_lets_go_during_a_pause_is_held_again(cell: PausedCell) -> None:
    """A program of the twin's side resumes it and commands a joint: that ends, and is said.

    It still follows the robot, so it goes back to where that one stands.
    """
    rested = led_by_the_robot_and_paused(cell)
    cell.twin.told(Command.RESUME)
    for _ in range(20):
        cell.twin.command_velocity("joint_1", 0.25)
        cell.schedule.run(0.05)
    assert travel(cell.twin.truth, rested) < 3.0, "held within 0.2 s"
    assert "the twin is paused" in cell.twin.refused[-1]
    assert cell.real_went(rested) < AT_REST_DEG_MM
    held_again(cell)


def test_a_move_that_begins_on_the_twin_during_a_pause_is_held(cell: PausedCell) -> None:
    """A program of the twin's side had resumed it, so its pose controller took the move."""
    rested = led_by_the_robot_and_paused(cell)
    cell.twin.told(Command.RESUME)
    cell.twin.lose_stream()
    cell.twin.move_to.begin((0.51, 0.16, 0.10), 50.0, "", lambda *_: None)
    cell.schedule.run(2.0)
    assert standstill_since(cell.twin.truth, rested) < rested + 0.5
    assert cell.real_went(rested) < AT_REST_DEG_MM
    held_again(cell)
    answer = cell.operate("RESUME")
    assert not answer.success and "no longer stands where it was paused" in answer.message


@pytest.mark.parametrize("led_by", ["operator", "real"])
def test_nothing_moves_the_robot_beside_a_person_during_a_pause(led_by: str) -> None:
    """A person at 0.8 m, a jog and direct commands: safety counts in PAUSED too."""
    with PausedCell(monitored=True) as cell:
        go(cell, 5.0) if led_by == "operator" else run_program(cell)
        cell.schedule.run(0.3)
        assert cell.operate("PAUSE").success
        both_stood(cell, cell.schedule.now)
        rested = cell.schedule.now
        cell.person = (0.8, 0.0, 0.2)
        cell.schedule.run(0.3)
        cell.jog()
        cell.push_twin()
        assert cell.real_went(rested) < AT_REST_DEG_MM
        assert not cell.operate("RESUME").success


def test_a_robot_that_moves_during_a_pause_beside_a_person_is_stopped() -> None:
    """A hold that somebody has lifted past us does not take the guard away."""
    with PausedCell(monitored=True) as cell:
        run_program(cell)
        cell.schedule.run(0.3)
        assert cell.operate("PAUSE").success
        both_stood(cell, cell.schedule.now)
        cell.person = (0.9, 0.0, 0.2)
        cell.schedule.run(0.6)
        cell.real.signal("hold", True)
        cell.real.signal("start", None)
        moved = cell.schedule.now
        cell.wait_whatever(lambda: cell.mode == "STOPPED", 1.0, "STOPPED")
        assert both_stood(cell, moved) - moved < 1.0


@pytest.mark.parametrize("speed_percent", [*thorough(5.0, 30.0), 70.0])
def test_resume_goes_on_on_the_same_path(cell: PausedCell, speed_percent: float) -> None:
    """The twin waits until the robot, held where it was, has come to it; then both go on."""
    start = cell.real.truth[-1][1]
    go(cell, speed_percent)
    cell.wait_whatever(
        lambda: cell.real.truth[-1][1][0] > 0.25 * AWAY[0], 30.0, "a quarter of the way"
    )
    assert cell.operate("PAUSE").success
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    cell.schedule.run(0.5)
    assert cell.real_went(rested) < AT_REST_DEG_MM
    begun = len(cell.real.truth)
    assert cell.operate("RESUME").success
    cell.wait_until(lambda: cell.mode == "IDLE", 60.0, "IDLE")
    assert cell.real.truth[-1][1] == pytest.approx(AWAY, abs=math.radians(0.02))
    # All joints of a joint move have gone the same part of their way at each time.
    for _, q, _ in cell.real.truth[begun:]:
        first = (q[0] - start[0]) / (AWAY[0] - start[0])
        second = (q[1] - start[1]) / (AWAY[1] - start[1])
        assert abs(first - second) < 0.01


def test_resume_of_a_program_goes_on_on_the_robots_own_path(cell: PausedCell) -> None:
    """The program waits in its line; the twin follows it again."""
    run_program(cell)
    cell.schedule.run(0.5)
    assert cell.operate("PAUSE").success
    # START reaches a paused program alone: this one would pause behind it, for good.
    assert "the real robot has not shown the pause yet" in cell.operate("RESUME").message
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    cell.schedule.run(1.0)
    assert cell.real_went(rested) < AT_REST_DEG_MM
    assert cell.operate("RESUME").success
    cell.wait_until(lambda: not cell.real.running, 30.0, "the end of the program")
    cell.wait_until(lambda: cell.mode == "IDLE", 10.0, "IDLE")
