"""$SNPX_ASG over a socket: another client changes the table under the twin controller's feet."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from harness.processes import wait_until
from harness.workspace import ROOT
from pymodbus.client import ModbusTcpClient
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.robot_sample import RobotSample

if TYPE_CHECKING:
    from .conftest import Asked

CONFIG = ROOT / "config"


def assign(client: ModbusTcpClient, slot: int, address: int, size: int) -> None:
    """Change address and size of an entry, through entry 80."""
    for field, value in (("$ADDRESS", address), ("$SIZE", size)):
        name = struct.unpack(">40H", f"$SNPX_ASG[{slot}].{field}".encode().ljust(80, b"\0"))
        entry = [16000, 0, 2, 0, *name, 0, 0x3F80]
        assert not client.write_registers(16299, entry).isError()
        assert not client.write_registers(15999, [value, 0]).isError()


def test_an_emptied_table_is_a_lost_link(asked: Asked) -> None:
    """The position reads as not valid, so no sample is believed; with its entry back it reads."""
    robot, layout = load_robot(CONFIG), load_modbus_map(CONFIG)
    samples: list[RobotSample] = []
    rejects: list[str] = []
    settings = ModbusSettings("127.0.0.1", asked.port, timeout=1.0)
    driver = ModbusTcpClient("127.0.0.1", port=asked.port, timeout=2.0)
    assert driver.connect()
    with ModbusLink(
        settings,
        layout,
        robot,
        lambda sample, *_: samples.append(sample),
        lambda *_: None,
        on_reject=rejects.append,
    ):
        wait_until(lambda: samples, 5.0)
        assign(driver, 3, 0, 0)
        wait_until(lambda: any("position is not valid" in text for text in rejects), 5.0)
        count = len(samples)
        assign(driver, 3, 11001, 19)
        wait_until(lambda: len(samples) > count + 10, 5.0)
    driver.close()
