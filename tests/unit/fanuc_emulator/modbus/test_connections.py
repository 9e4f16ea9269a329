"""So many clients as $SNPX_PARAM.$NUM_MODBUS says."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import pytest
from fanuc_emulator.config import EmulatorConfig, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.modbus_server_io import RobotServer
from fanuc_emulator.register_image import RegisterImage
from harness.processes import free_port
from harness.workspace import ROOT
from scara_config import Robot
from scara_config.modbus_map import load_modbus_map

from .conftest import Asked, answers, request

READ = "03 2AF8 0001"


@contextmanager
def serving(config: EmulatorConfig, robot: Robot, num_modbus: int) -> Iterator[Asked]:
    """Run a robot that serves so many clients."""
    settings = msgspec.structs.replace(config.settings, num_modbus=num_modbus)
    config = msgspec.structs.replace(config, settings=settings)
    layout = load_modbus_map(ROOT / "config")
    controller = Controller(config, robot, load_programs(robot, ROOT / "config"), 1.7e9)
    loop, image = ServoLoop(controller, config.dt, 0.0), RegisterImage(layout, robot)
    found = Asked(free_port())
    server = RobotServer(
        "127.0.0.1", found.port, layout, image, loop, tell=found.told.append, settings=settings
    )
    with loop, server:
        yield found
    assert loop.failure is None


def test_as_delivered_nobody_is_served(config: EmulatorConfig, robot: Robot) -> None:
    """The connection is refused."""
    with serving(config, robot, 0) as asked, pytest.raises(ConnectionRefusedError):
        asked.connect()


def test_one_client_too_many_ends_the_connection_that_is_silent_for_longest(
    config: EmulatorConfig, robot: Robot
) -> None:
    """The first one asks last, so the second one goes."""
    with (
        serving(config, robot, 2) as asked,
        asked.connect() as first,
        asked.connect() as second,
    ):
        for line in (second, first):
            line.sendall(request(1, READ))
            assert answers(line, 1)[0][2] == "03 02 00 00"
        assert asked.ask(READ) == "03 02 00 00"
        first.sendall(request(2, READ))
        assert answers(first, 1)[0][0] == 2
        assert second.recv(1) == b""
