"""The shipped configuration, and a controller to play with."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from pathlib import Path

import pytest
from fanuc_emulator.config import EmulatorConfig, load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.snapshot import ControlType, Snapshot
from fanuc_emulator.tp.executor import Program
from scara_config import Robot, load_robot
from scara_config.modbus_map import load_modbus_map

CONFIG = Path(__file__).resolve().parents[3] / "config"
PULSE_S = load_modbus_map(CONFIG).coils["start"].pulse_ms * 1e-3


class Bench:
    """A controller, stepped by the test; keeps the last snapshot."""

    def __init__(self, config: EmulatorConfig, robot: Robot, programs: dict[int, Program]) -> None:
        self.config, self.robot = config, robot
        self.controller = Controller(config, robot, programs, boot_seconds=1.7e9)
        self.now = self.controller.snapshot()
        self.history: list[Snapshot] = []

    def run(self, seconds: float) -> Snapshot:
        """Let time pass."""
        for _ in range(round(seconds / self.config.dt)):
            self.now = self.controller.step()
            self.history.append(self.now)
        return self.now

    def run_until(self, condition: Callable[[Snapshot], bool], limit: float = 30.0) -> Snapshot:
        """Let time pass until ``condition`` holds; fail after ``limit`` [s]."""
        for _ in range(round(limit / self.config.dt)):
            if condition(self.now):
                return self.now
            self.run(self.config.dt)
        raise AssertionError(f"not within {limit} s: {self.now}")

    def pulse(self, name: str, length: float | None = None) -> None:
        """Switch an input on and off again, by default as the map says."""
        self.controller.write_input(name, True)
        self.run(PULSE_S if length is None else length)
        self.controller.write_input(name, False)
        self.run(0.004)

    def stream_to(self, joint: str, value: float) -> None:
        """Write a set point with one joint changed [rad or m]."""
        names = [each.name for each in self.robot.joints]
        positions = list(self.now.positions)
        positions[names.index(joint)] = value
        self.controller.write_setpoint(positions)
        self.controller.write_setpoint_valid(True)

    @property
    def moving(self) -> bool:
        """Whether an axis moves."""
        return any(velocity != 0.0 for velocity in self.now.velocities)

    def start_moving(self) -> None:
        """Run until ARTICLE's first real motion is at speed."""
        self.pulse("rsr2")
        self.run_until(lambda now: max(abs(v) for v in now.velocities) > 1.0)

    def start_stream(self) -> None:
        """Start the stream program at the present position."""
        self.stream_to("joint_1", self.now.positions[0])
        self.pulse("rsr1")
        self.run(0.05)
        assert self.now.control_type is ControlType.STREAM

    def cruising(self, axis: int) -> float:
        """Return the speed that an axis kept longest [rad/s]."""
        speeds = [abs(now.velocities[axis]) for now in self.history]
        return statistics.median(speed for speed in speeds if speed > 0.8 * max(speeds))


@pytest.fixture(scope="session")
def robot() -> Robot:
    """Return the shipped robot profile."""
    return load_robot(CONFIG)


@pytest.fixture(scope="session")
def config(robot: Robot) -> EmulatorConfig:
    """Return the shipped emulator.yaml."""
    return load_emulator(robot, CONFIG)


@pytest.fixture
def bench(config: EmulatorConfig, robot: Robot) -> Bench:
    """Return a freshly booted controller at 100 % override."""
    bench = Bench(config, robot, load_programs(robot, CONFIG))
    bench.controller.write_override(100)
    bench.run(0.01)
    return bench
