"""The stand-in on a port of its own, set up as a test wants it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from fanuc_emulator.config import EmulatorConfig, load_emulator, load_programs, on_a_desk
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.modbus_server_io import RobotServer
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.snpx.assignments import AssignmentTable
from scara_config import Robot, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_config.profile import DEFAULT_PLANT

from harness.processes import free_port
from harness.workspace import ROOT

CONFIG = ROOT / "config"
ROBOT, LAYOUT = load_robot(CONFIG), load_modbus_map(CONFIG)


class Served(NamedTuple):
    """A stand-in that runs: where, its servo loop, and what answers for it."""

    port: int
    loop: ServoLoop
    server: RobotServer


def stand_in(
    config: EmulatorConfig, robot: Robot = ROBOT, layout: ModbusMap = LAYOUT
) -> Controller:
    """Return a stand-in with the shipped programs, to be stepped."""
    return Controller(
        *(config, robot, load_programs(robot, CONFIG), 1.7e9),
        random=np.random.default_rng(1),
        ring_places=layout.ring_places,
    )


@contextmanager
def running(
    config: EmulatorConfig | None = None,
    robot: Robot = ROBOT,
    layout: ModbusMap = LAYOUT,
    address: tuple[str, int] = ("127.0.0.1", 0),
    **options: Any,
) -> Iterator[Served]:
    """Run a stand-in, the shipped one if nothing else is given.

    Args:
        config: How it was set up, and its plant.
        robot: Its joints.
        layout: Its registers.
        address: Host and port; 0: any that is free.
        options: Of the server.
    """
    config = config or load_emulator(robot, CONFIG)
    loop = ServoLoop(stand_in(config, robot, layout), config.dt, config.plant.clock.drift_ppm)
    host, port = address[0], address[1] or free_port()
    server = RobotServer(host, port, layout, RegisterImage(layout, robot), loop, **options)
    with loop, server:
        yield Served(port, loop, server)
    assert loop.failure is None


@contextmanager
def served(
    settings: str,
    mistype: Callable[[AssignmentTable], None] = lambda _: None,
    plant: str = DEFAULT_PLANT,
    strict: bool = False,
) -> Iterator[tuple[int, ServoLoop, list[Any]]]:
    """Run a stand-in that was set up so, with slots that somebody typed wrongly.

    Give its port, its loop, and what is written to it. Its watchdog waits as on a desk, for it
    shares this machine, unless it is ``strict``.
    """
    config = load_emulator(ROBOT, CONFIG, plant, settings)
    config = config if strict else on_a_desk(config)
    with running(config, tell=lambda _: None, settings=config.settings) as (port, loop, server):
        store, written = server._datastore, []
        assert store.assigned is not None
        mistype(store.assigned.table)
        write = store.async_setValues

        async def counted(*request: Any) -> Any:
            written.append(request)
            return await write(*request)

        store.async_setValues = counted  # type: ignore[method-assign]
        yield port, loop, written


def last_beat(written: list[Any]) -> int:
    """Return the heartbeat that was written last to a stand-in that was served; 0 disarms."""
    at = LAYOUT.holding_registers["heartbeat"].offset
    return int([words for _, _, offset, words in written if offset == at][-1][0])
