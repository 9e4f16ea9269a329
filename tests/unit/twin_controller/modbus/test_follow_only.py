"""The link to a robot that is only followed, against the stand-in as delivered, on the wire."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import pytest
from fanuc_emulator.config import load_emulator
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.modbus_server_io import RobotServer
from fanuc_emulator.pendant.pendant_link_io import PendantLink
from fanuc_emulator.uop import with_panel
from harness.emulated.served import running
from harness.followed import FOLLOW_MAP
from harness.processes import wait_until
from harness.workspace import ROOT
from scara_config import ConfigError, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_config.set_up.kit_map import kit_map
from scara_config.set_up.slots import slot_table
from twin_controller.core.actions import Command
from twin_controller.core.events import RealMeasured
from twin_controller.modbus.port_io import ModbusSettings
from twin_controller.modbus.robot_link_io import ModbusRobotLink
from twin_controller.registers import RegisterCodec
from twin_controller.robot.link import NotWritableError
from twin_controller.robot.real_link_io import RealLink
from twin_controller.robot_sample import RobotSample

CONFIG = ROOT / "config"
SHIPPED = load_robot(CONFIG)
STOPPING = msgspec.structs.replace(SHIPPED.stopping, uop="simple", tried={})
ROBOT = msgspec.structs.replace(SHIPPED, lead=False, stopping=STOPPING)
AS_DELIVERED = "delivered, num_modbus: 1, slots: kit, mode: AUTO"


class Seen:
    """What the link tells."""

    def __init__(self) -> None:
        self.inputs: list[object] = []
        self.samples: list[RobotSample] = []

    def link(self, port: int) -> RealLink:
        """Return the controller's own link."""
        settings = ModbusSettings("127.0.0.1", port, timeout=3.0)
        return RealLink(
            ROBOT,
            FOLLOW_MAP.has_gripper,
            lambda listener: ModbusRobotLink(settings, FOLLOW_MAP, ROBOT, listener),
            self.inputs.append,
            lambda side, up, why: None,
            lambda sample, *words: self.samples.append(sample),
            alive=lambda: True,
        )

    @property
    def flags(self) -> RealMeasured:
        """The newest sample as the core hears it."""
        return next(each for each in reversed(self.inputs) if isinstance(each, RealMeasured))


@contextmanager
def stand_in(layout: ModbusMap) -> Iterator[tuple[ServoLoop, RobotServer, int]]:
    """Run the field plant as it is delivered, with Modbus switched on for one client."""
    config = load_emulator(ROBOT, CONFIG, "field", AS_DELIVERED)
    with running(config, ROBOT, layout, settings=config.settings) as (port, loop, server):
        yield loop, server, port


@pytest.fixture
def delivered() -> Iterator[tuple[ServoLoop, RobotServer, int]]:
    """Give a stand-in that shows what the map of who follows has, and no more."""
    with stand_in(FOLLOW_MAP) as running:
        yield running


@pytest.mark.parametrize("layout", [FOLLOW_MAP, kit_map(load_modbus_map(CONFIG))])
def test_a_person_starts_a_program_at_a_robot_whose_map_has_no_keys(layout: ModbusMap) -> None:
    """The stand-in has its own; a map that has keys gets the mode switch; no slot moves."""
    shipped = load_modbus_map(CONFIG)
    more = with_panel(shipped).coils.keys() - shipped.coils.keys()
    assert more == {"panel_auto", "panel_t1", "panel_t2"}
    assert slot_table(with_panel(layout)) == slot_table(layout)
    with (
        stand_in(with_panel(layout)) as (loop, _, port),
        PendantLink("127.0.0.1", port, layout) as pendant,
    ):
        pendant.write("override", [40])
        pendant.pulse("panel_run2")
        wait_until(lambda: loop.snapshot.program_name != "", 5.0)
        assert {*pendant.outputs()} == {*layout.discrete_inputs} and pendant.signal("sfspd")
        wait_until(lambda: pendant.read("override_now")[0] == 40, 5.0)


def test_nothing_is_written_while_a_program_runs_is_held_and_loses_its_drives(
    delivered: tuple[ServoLoop, RobotServer, int],
) -> None:
    """Connected, followed and left; whatever the core would send is refused here too."""
    loop, server, port = delivered
    seen = Seen()
    with seen.link(port) as link:
        wait_until(lambda: len(seen.samples) > 20, 10.0)
        assert seen.samples[-1].motion.qdot == () and seen.flags.drives_on
        loop.post(lambda robot: robot.write_override(100))
        loop.post(lambda robot: robot.pulse_input("panel_run2"))
        wait_until(lambda: seen.flags.own_program, 5.0)
        begun = seen.flags.motion.q
        wait_until(lambda: abs(seen.flags.motion.q[0] - begun[0]) > 0.05, 10.0)
        assert seen.flags.speed_percent is None and seen.flags.program
        loop.post(lambda robot: robot.write_input("panel_hold", False))
        wait_until(lambda: seen.flags.paused, 5.0)
        loop.post(lambda robot: robot.write_input("panel_imstp", False))
        wait_until(lambda: not seen.flags.drives_on, 5.0)
        for command in (Command.STOP_REAL, Command.ESTOP_REAL, Command.RESET_REAL):
            with pytest.raises(NotWritableError, match="lead is false"):
                link.perform(command)
        with pytest.raises(NotWritableError, match="lead is false"):
            link.override(50.0)
    assert server.writes == 0
    assert link.counters["setpoints"] == link.counters["losses"] == 0


def test_a_map_without_a_written_register_leads_no_robot() -> None:
    """Said at the start, with the key."""
    with pytest.raises(ConfigError, match="must say lead: false"):
        RegisterCodec(FOLLOW_MAP, SHIPPED)
    assert RegisterCodec(load_modbus_map(CONFIG), ROBOT).setpoint is not None
