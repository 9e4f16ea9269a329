"""The stand-in drives set points ahead of their time; whoever stops it empties the ring at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fanuc_emulator.config import EmulatorConfig, load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.tp.executor import ProgramState
from scara_config import Robot, load_robot
from scara_config.modbus_map import load_modbus_map

CONFIG = Path(__file__).resolve().parents[4] / "config"
PULSE_S = 0.12
"""Longer than the shortest one that the robot sees [s]."""
PLACES, SPACING = 10, 12


class Stage:
    """A stand-in whose stream program runs, and a client that keeps its ring full."""

    def __init__(self, robot: Robot, config: EmulatorConfig) -> None:
        self.robot, self.config = robot, config
        programs, draws = load_programs(robot, CONFIG), np.random.default_rng(1)
        self.controller = Controller(
            config, robot, programs, boot_seconds=1.7e9, random=draws, ring_places=PLACES
        )
        self.controller.write_override(100)
        self.now = self.controller.step()
        self.home = self.now.positions
        self.number, self.time = 0, self.now.clock_ms
        self.times, self.rows = [-1] * PLACES, [self.home] * PLACES
        self.fed = True
        # How fast joint_1 is told to move [rad/s].
        self.rate, self.at = 0.0, self.home[0]

    def run(self, seconds: float) -> None:
        """Let time pass; while somebody feeds it, the ring reaches nine set points ahead."""
        for _ in range(round(seconds / self.config.dt)):
            if self.fed:
                self._feed()
            self.now = self.controller.step()

    def _feed(self) -> None:
        ring = self.controller.source.ring
        changed = False
        while self.time < self.now.clock_ms + (PLACES - 1) * SPACING:
            self.number, self.time = self.number + 1, self.time + SPACING
            self.at += self.rate * 1e-3 * SPACING
            place = (self.number - 1) % PLACES
            self.times[place], self.rows[place] = self.time, (self.at, *self.home[1:])
            changed = True
        if changed:
            ring.write_rows(self.rows)
            ring.write_times(self.times)
            ring.write_newest(self.number)

    def start(self) -> None:
        """Start the stream program and wait until it runs."""
        self.run(0.02)
        self.controller.write_input("rsr1", True)
        self.run(PULSE_S)
        self.controller.write_input("rsr1", False)
        self.run(0.5)
        assert self.now.program_state is ProgramState.RUNNING


@pytest.fixture
def stage() -> Stage:
    """Return a stand-in that follows its ring."""
    robot = load_robot(CONFIG)
    made = Stage(robot, load_emulator(robot, CONFIG))
    made.start()
    return made


def test_a_client_that_stands_still_is_not_noticed(stage: Stage) -> None:
    """For 100 ms the robot goes on as it was told; then it stands, and the underrun is counted."""
    stage.rate = 1.0
    stage.run(0.5)
    speed = stage.now.velocities[0]
    stage.fed = False
    stage.run(0.1)
    assert stage.now.velocities[0] == pytest.approx(speed, rel=0.01) and speed > 0.9
    assert stage.now.ring_underruns == 0
    stage.run(0.3)
    assert stage.now.velocities[0] == pytest.approx(0.0, abs=1e-3)
    assert stage.now.ring_underruns == 1


@pytest.mark.parametrize(
    ("signal", "level"),
    [("hold", False), ("panel_hold", False), ("cstopi", True), ("imstp", False), ("enbl", False)],
)
def test_a_stop_empties_the_ring_at_once(stage: Stage, signal: str, level: bool) -> None:
    """Also while a client goes on to believe in it: nothing of it is driven afterwards."""
    stage.rate = 1.0
    stage.run(0.5)
    stage.fed = False
    stage.controller.write_input(signal, level)
    assert not stage.controller.source.ring.fed
    before = stage.now.positions[0]
    stage.run(0.05)
    slow = stage.now.velocities[0]
    stage.run(1.0)
    stood = stage.now.positions[0]
    # It brakes with the joint's own acceleration: no set point holds that up.
    assert slow < 0.7 and stood - before < 0.12
    stage.controller.write_input(signal, not level)
    stage.run(1.0)
    assert stage.now.positions[0] == pytest.approx(stood, abs=1e-4)


def test_a_held_program_goes_on_with_new_set_points_only(stage: Stage) -> None:
    """START after HOLD: the robot stays until somebody gives it set points again."""
    stage.rate = 1.0
    stage.run(0.5)
    stage.fed = False
    stage.controller.write_input("hold", False)
    stage.run(0.5)
    stage.controller.write_input("hold", True)
    for level in (True, False):
        stage.controller.write_input("start", level)
        stage.run(PULSE_S)
    stood = stage.now.positions[0]
    stage.run(0.5)
    assert stage.now.program_state is ProgramState.RUNNING
    assert stage.now.positions[0] == pytest.approx(stood, abs=1e-4)
    stage.rate, stage.at, stage.fed = 0.0, stood + 0.05, True
    stage.time = stage.now.clock_ms
    stage.run(0.5)
    assert stage.now.positions[0] == pytest.approx(stood + 0.05, abs=1e-3)


@pytest.mark.parametrize(("bad", "text"), [(float("nan"), "Uninitialized"), (9.0, "Limit error")])
def test_a_set_point_where_the_robot_cannot_go_pauses_the_program(
    stage: Stage, bad: float, text: str
) -> None:
    """As a PR[1] does, when it is its turn; the alarm names the joint."""
    stage.run(0.1)
    stage.at = bad
    stage.run(0.3)
    assert stage.now.program_state is ProgramState.PAUSED
    assert stage.now.alarm is not None and text in stage.now.alarm.code.text
    assert "J1" in stage.now.alarm.cause


@pytest.mark.parametrize("plant", ["ideal", "field"])
def test_a_time_without_positions_pauses_the_program(plant: str) -> None:
    """Nobody has written set points since boot: the stand-in says so and goes on."""
    robot = load_robot(CONFIG)
    stage = Stage(robot, load_emulator(robot, CONFIG, plant))
    stage.fed = False
    stage.start()
    ring = stage.controller.source.ring
    ring.write_times([stage.now.clock_ms] * PLACES)
    ring.write_newest(1)
    stage.run(0.3)
    assert stage.now.program_state is ProgramState.PAUSED
    assert stage.now.alarm is not None and "Uninitialized" in stage.now.alarm.code.text
    assert stage.now.positions == pytest.approx(stage.home, abs=1e-4)


def test_who_writes_pr_1_needs_no_ring(stage: Stage) -> None:
    """Once the ring is taken back, PR[1] counts again."""
    stage.fed = False
    stage.controller.source.ring.write_newest(0)
    stage.controller.write_setpoint((stage.home[0] + 0.1, *stage.home[1:]))
    stage.controller.write_setpoint_valid(True)
    stage.run(1.0)
    assert stage.now.positions[0] == pytest.approx(stage.home[0] + 0.1, abs=1e-3)


def test_the_shipped_maps_have_room_for_ten() -> None:
    """All three robots take set points ahead."""
    for name in ("fanuc_sr6ia", "fanuc_sr3ia", "articulated_six"):
        assert load_modbus_map(CONFIG / "robots" / name).ring_places == PLACES
