"""The stand-in on a port of its own, set up as a test wants it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.modbus_server_io import RobotServer
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.snpx.assignments import AssignmentTable
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import DEFAULT_PLANT

from harness.processes import free_port
from harness.workspace import ROOT

CONFIG = ROOT / "config"
ROBOT, LAYOUT = load_robot(CONFIG), load_modbus_map(CONFIG)


@contextmanager
def served(
    settings: str,
    mistype: Callable[[AssignmentTable], None] = lambda _: None,
    plant: str = DEFAULT_PLANT,
) -> Iterator[Any]:
    """Run a stand-in that was set up so, with slots that somebody typed wrongly."""
    config = load_emulator(ROBOT, CONFIG, plant, settings)
    controller = Controller(
        config,
        ROBOT,
        load_programs(ROBOT, CONFIG),
        1.7e9,
        random=np.random.default_rng(1),
        ring_places=LAYOUT.ring_places,
    )
    loop, port = ServoLoop(controller, config.dt, 0.0), free_port()
    image = RegisterImage(LAYOUT, ROBOT)
    server = RobotServer(
        "127.0.0.1", port, LAYOUT, image, loop, tell=lambda _: None, settings=config.settings
    )
    store, written = server._datastore, []
    assert store.assigned is not None
    mistype(store.assigned.table)
    write = store.async_setValues

    async def counted(*request: Any) -> Any:
        written.append(request)
        return await write(*request)

    store.async_setValues = counted  # type: ignore[method-assign]
    with loop, server:
        yield port, loop, written
    assert loop.failure is None
