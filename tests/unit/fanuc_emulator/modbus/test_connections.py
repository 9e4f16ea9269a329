"""So many clients as $SNPX_PARAM.$NUM_MODBUS says."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import pytest
from fanuc_emulator.config import EmulatorConfig
from harness.emulated.served import running
from scara_config import Robot

from .conftest import Asked, answers, request

READ = "03 2AF8 0001"


@contextmanager
def serving(config: EmulatorConfig, robot: Robot, num_modbus: int) -> Iterator[Asked]:
    """Run a robot that serves so many clients."""
    settings = msgspec.structs.replace(config.settings, num_modbus=num_modbus)
    config = msgspec.structs.replace(config, settings=settings)
    with running(config, robot, settings=settings) as stand_in:
        yield Asked(stand_in.port)


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
