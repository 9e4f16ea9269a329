"""A robot that can misbehave, and a link to it that tells an owner."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from harness.opponents.modbus_robot import COMMAND, COMMAND_ECHO, Robot
from harness.processes import wait_until
from scara_config import Robot as Profile
from scara_config import load_robot
from scara_config.modbus_map import CommandWord, Register, SignalCode, load_modbus_map
from twin_controller.modbus import connection_io
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.robot_sample import AlarmStatus, ProgramStatus, RobotSample

CONFIG = Path(__file__).resolve().parents[4] / "config"
ROBOT, LAYOUT = load_robot(CONFIG), load_modbus_map(CONFIG)
# The same with numbered commands, under the codes of articulated_six.
NUMBERED = msgspec.structs.replace(
    LAYOUT,
    coils={},
    holding_registers={
        **LAYOUT.holding_registers,
        "command": Register(COMMAND + 1, "int16", "code", "", write=True),
        "command_sequence": Register(COMMAND + 2, "int16", "count", "", write=True),
        "command_echo": Register(COMMAND_ECHO + 1, "int16", "count", ""),
    },
    command_word=CommandWord(
        "command",
        "command_sequence",
        "command_echo",
        {
            "imstp": SignalCode(low=1, high=2),
            "hold": SignalCode(low=3, high=4),
            "cstopi": SignalCode(pulse=10),
        },
    ),
)


class Owner:
    """Collects what the link tells."""

    def __init__(self) -> None:
        self.samples: list[tuple[RobotSample, float, float]] = []
        self.changes: list[tuple[bool, str]] = []
        self.statuses: list[tuple[ProgramStatus, AlarmStatus]] = []
        self.rejects: list[str] = []

    def link(
        self,
        port: int,
        profile: Profile = ROBOT,
        alive: Callable[[], bool] = lambda: True,
        on_sample: Callable[..., object] | None = None,
        numbered: bool = False,
        **settings: float | bool,
    ) -> ModbusLink:
        """Return a link that tells this owner, its samples perhaps to somebody else."""
        # Patient, too: this machine's own delays are no silence of the robot.
        quick = {"retry_first": 0.02, "retry_last": 0.05, "timeout": 3.0, **settings}
        return ModbusLink(
            ModbusSettings("127.0.0.1", port, **quick),  # type: ignore[arg-type]
            NUMBERED if numbered else LAYOUT,
            profile,
            on_sample or (lambda *sample: self.samples.append(sample)),
            lambda *change: self.changes.append(change),
            lambda *status: self.statuses.append(status),
            self.rejects.append,
            alive,
        )

    def wait_for(self, *changes: bool) -> None:
        """Wait until the link was reported up and down in this order."""
        wait_until(
            lambda: tuple(up for up, _ in self.changes) == changes,
            5.0,
            f"{changes}, seen {self.changes}",
        )


@pytest.fixture
def robot() -> Iterator[Robot]:
    """Return a robot that listens."""
    robot = Robot()
    yield robot
    robot.close()


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing be asked twice because this machine was late."""
    monkeypatch.setattr(connection_io, "SHORTEST_WAIT", 0.1)


@pytest.fixture
def owner() -> Owner:
    """Return a fresh owner."""
    return Owner()


@pytest.fixture
def link(robot: Robot, owner: Owner) -> Iterator[ModbusLink]:
    """Return a link that is up."""
    with owner.link(robot.port) as made:
        owner.wait_for(True)
        yield made
