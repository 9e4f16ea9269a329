"""A robot with another kind of controller on the wire.

Input registers, counts, numbered commands, signals in a word.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
from fanuc_emulator.pendant.pendant_link_io import PendantError, PendantLink
from fanuc_emulator.pendant.pendant_node import app as pendant_app
from harness.emulated.served import CONFIG, running
from harness.processes import wait_until
from pymodbus.client import ModbusTcpClient
from robot_doctor.finding import Level
from robot_doctor.link_checks import check_answers
from robot_doctor.set_up_probe_io import ask
from scara_config import Robot, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_config.profile import CHOICE
from twin_controller.config import load_twin_controller
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.robot.signals import Number, Pulse
from twin_controller.robot_sample import ControlType, RobotSample
from typer.testing import CliRunner


@pytest.fixture(scope="module")
def profile() -> tuple[Robot, ModbusMap]:
    """Return the six-joint robot and its map."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CHOICE, "articulated_six")
        return load_robot(CONFIG), load_modbus_map(CONFIG)


@pytest.fixture
def port(profile: tuple[Robot, ModbusMap], monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Run its stand-in."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    with running(None, *profile) as stand_in:
        yield stand_in.port


@pytest.fixture
def client(port: int) -> Iterator[ModbusTcpClient]:
    """Give a plain client."""
    client = ModbusTcpClient("127.0.0.1", port=port, timeout=2.0)
    assert client.connect()
    yield client
    client.close()


def test_state_stands_in_input_registers_as_counts_high_word_first(client: ModbusTcpClient) -> None:
    """joint_2 = 39.01 deg is 39010 counts; no holding register is there, and no coil."""
    words = client.read_input_registers(102, count=2, device_id=17).registers
    assert words == [0, 39010]
    assert client.read_holding_registers(102, count=2, device_id=17).exception_code == 2
    assert client.read_coils(0, count=1, device_id=17).exception_code == 1
    assert client.write_coil(0, True, device_id=17).exception_code in (1, 2)


def test_a_command_counts_once_when_its_number_changes(client: ModbusTcpClient) -> None:
    """HOLD off is obeyed and confirmed; another code needs another number."""

    def held() -> bool:
        return bool(client.read_input_registers(132, count=1, device_id=17).registers[0] >> 4 & 1)

    def echo() -> int:
        return int(client.read_input_registers(133, count=1, device_id=17).registers[0])

    assert echo() == 0, "no command yet"
    client.write_registers(60, [3, 11], device_id=17)
    wait_until(lambda: held() and echo() == 11, 5.0)
    client.write_registers(60, [4, 11], device_id=17)
    client.write_registers(
        50, [500], device_id=17
    )  # a later write, to see that the one before was looked at
    wait_until(
        lambda: client.read_input_registers(131, count=1, device_id=17).registers == [500], 5.0
    )
    assert held()
    client.write_registers(60, [4, 12], device_id=17)
    wait_until(lambda: not held() and echo() == 12, 5.0)


def test_the_pendant_works_by_the_same_map(port: int, profile: tuple[Robot, ModbusMap]) -> None:
    """Override in tenths, a program by command, lamps from words; what is lacking is said."""
    with PendantLink("127.0.0.1", port, profile[1]) as pendant:
        pendant.write("override", [30])
        wait_until(lambda: pendant.read("override_now") == (30.0,), 5.0)
        pendant.pulse("rsr3")
        wait_until(
            lambda: pendant.outputs()["progrun"] and pendant.read("program_name") == "TWO_POINT",
            5.0,
        )
        assert pendant.signal("imstp") and pendant.read("alarm_cause") == ""
        pendant.pulse("cstopi")
        wait_until(lambda: not pendant.outputs()["progrun"], 5.0)
        with pytest.raises(PendantError, match="no command for home"):
            pendant.pulse("home")


def test_the_pendants_command_starts_a_program_without_a_severity(port: int) -> None:
    """FAULT tells of an alarm that stops, and the message alone says which one."""

    def pendant(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(pendant_app, [*words, "--port", str(port)])
        return result.exit_code, result.output

    assert pendant("reset") == (0, "ready\n")
    assert pendant("override", "100")[0] == 0
    code, text = pendant("run", "TWO_POINT", "--wait")
    assert code == 0 and text.endswith("TWO_POINT ended\n")
    with PendantLink("127.0.0.1", port, load_modbus_map(CONFIG)) as link:
        link.set_signal("panel_imstp", False)
    wait_until(lambda: "SRVO-001" in pendant("status")[1], 5.0)
    code, text = pendant("run", "TWO_POINT")
    assert code == 1 and "FAULT is on: SRVO-001 Operator panel E-stop;" in text
    assert pendant("reset") == (0, "ready\n")


def test_the_twin_controllers_link_streams_to_it(
    port: int, profile: tuple[Robot, ModbusMap]
) -> None:
    """The code for a Fanuc connects, starts the stream by a command, follows all six joints."""
    robot, layout = profile
    samples: list[RobotSample] = []
    settings = ModbusSettings("127.0.0.1", port, timeout=1.0, heartbeat=False)
    with ModbusLink(
        settings, layout, robot, lambda sample, *_: samples.append(sample), lambda *_: None
    ) as link:
        wait_until(lambda: samples, 5.0)
        start = samples[-1].motion.q
        link.send(Number("override", 100))
        link.send(Pulse("rsr1"))
        wait_until(lambda: samples[-1].control_type is ControlType.STREAM, 5.0)
        target = tuple(q + 0.02 for q in start)
        begun = time.monotonic()
        while (
            time.monotonic() - begun < 10.0
            and max(abs(a - b) for a, b in zip(samples[-1].motion.q, target)) > 1e-4
        ):
            link.write_now(target, 50.0)
            time.sleep(0.01)
        assert samples[-1].motion.q == pytest.approx(target, abs=1e-4)
        link.send(Pulse("cstopi"))
        wait_until(lambda: samples[-1].control_type is ControlType.NONE, 5.0)
    assert link.counters.refused == 0


def test_the_doctor_finds_its_links_healthy(port: int, profile: tuple[Robot, ModbusMap]) -> None:
    """Answers are believed, the clock runs; how fast they are is no matter here."""
    robot, layout = profile
    answers = ask(robot, layout, "127.0.0.1", port, 0.01, 0.6, 2.0)
    config = load_twin_controller(robot, CONFIG)
    found = list(check_answers(robot, layout, answers, config))
    assert [finding.what for finding in found[1:] if finding.level is Level.WRONG] == []
