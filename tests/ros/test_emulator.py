"""The emulator and its pendant as processes.

With and without a roscore, read by mbpoll, stopped by its watchdog.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest
from fanuc_emulator.pendant.pendant_node import app as pendant
from harness.processes import Process, free_port, wait_until
from harness.ros import Ros
from harness.running.thorough import thorough
from harness.yaml_files import copy_configuration
from pymodbus.client import ModbusTcpClient
from robot_doctor.finding import Level
from robot_doctor.robot_probe_io import SWING, Mover
from ruamel.yaml import YAML
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool
from twin_controller.config import load_twin_controller
from twin_controller.modbus.link_io import ModbusLink, ModbusSettings
from twin_controller.robot.signals import Number, Pulse
from twin_controller.robot_sample import RobotSample
from typer.testing import CliRunner

from fanuc_emulator import emulator_node as emulator

NAMES = ["joint_1", "joint_2", "joint_3", "joint_4", "table_joint"]


class Cell:
    """A running emulator on a port of its own."""

    def __init__(self, ros: Ros, *parameters: str) -> None:
        self.ros = ros
        self.port = free_port()
        self.process: Process = ros.run(
            "fanuc_emulator", "emulator", f"_port:={self.port}", *parameters
        )
        self.client: Any = ModbusTcpClient("127.0.0.1", port=self.port, timeout=2.0, retries=0)
        wait_until(self._answers, 20.0, "the emulator's Modbus server")

    def _answers(self) -> bool:
        assert self.process.poll() is None, self.process.tail()
        return bool(self.client.connect())

    def pendant(self, *arguments: str) -> tuple[int, str]:
        """Run the pendant in this process and return its exit code and output."""
        result = CliRunner().invoke(pendant, [*arguments, "--port", str(self.port)])
        return result.exit_code, result.output

    def words(self, number: int, count: int = 1) -> list[int]:
        """Read registers by their number."""
        words: list[int] = self.client.read_holding_registers(number - 1, count=count).registers
        return words


@pytest.fixture(scope="module")
def standing(ros_module: Ros) -> Iterator[Cell]:
    """Return a running emulator that nothing moves."""
    cell = Cell(ros_module)
    yield cell
    cell.client.close()


@pytest.fixture(scope="module")
def running(ros_module: Ros) -> Iterator[Cell]:
    """Return a running emulator whose program ARTICLE is short."""
    folder = copy_configuration(ros_module.folder / "config")
    program = folder / "programs" / "ARTICLE.LS"
    text = program.read_text()
    assert ".70(sec)" in text and "1 TO 2" in text
    program.write_text(text.replace(".70(sec)", ".10(sec)").replace("1 TO 2", "1 TO 1"))
    cell = Cell(
        ros_module,
        f"_config_dir:={folder}",
        "__name:=moving_emulator",
        "real/ground_truth:=unheard",
    )
    yield cell
    cell.client.close()


@pytest.fixture
def cell(running: Cell) -> Cell:
    """Return an emulator without a program, a fault or a cap, ready for each test."""
    if running.words(11210) != [0]:
        running.pendant("abort")
    assert running.pendant("reset") == (0, "ready\n")
    running.pendant("override", "100")
    return running


def test_ground_truth_is_stamped_every_four_milliseconds_of_nominal_time(standing: Cell) -> None:
    """real/ground_truth.

    All joints, true positions and speeds, stamps on the servo's axis whatever the load.
    """
    received = standing.ros.collect("real/ground_truth", JointState)
    wait_until(lambda: len(received) >= 200, 20.0, "ground truth")
    assert received[0].name == NAMES
    assert received[0].position == pytest.approx((0.0, 0.0, -0.160, 0.0, 0.0))
    gaps = [
        after.header.stamp.to_sec() - before.header.stamp.to_sec()
        for before, after in pairwise(list(received))
    ]
    assert sorted(gaps)[len(gaps) // 2] == pytest.approx(0.004, abs=2e-5)


def test_a_vehicle_docks_and_leaves_by_a_service(standing: Cell) -> None:
    """Each stands elsewhere; what the dock's sensor saw is said."""
    dock = standing.ros.service("real/dock", SetBool)
    came = [dock(True), dock(True), dock(False), dock(False), dock(True)]
    assert [answer.success for answer in came] == [True, False, True, False, True]
    first, twice, left, _, second = (answer.message for answer in came)
    assert first.startswith("docked: UFRAME[2] is X ") and first != second
    assert (twice, left) == ("a vehicle is docked already", "the vehicle has left")


def test_mbpoll_reads_the_joints(standing: Cell) -> None:
    """An independent Modbus client reads J1..J5 as float32 low word first, and the signals."""
    read = ["mbpoll", "-m", "tcp", "-p", str(standing.port), "-a", "1", "-1", "127.0.0.1"]
    joints = subprocess.run(
        [*read, "-t", "4:float", "-r", "11001", "-c", "9"],
        capture_output=True,
        text=True,
        timeout=20,
    )
    values = [float(line.split()[1]) for line in joints.stdout.splitlines() if line.startswith("[")]
    assert values == [0.0, 0.0, -160.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], joints.stdout + joints.stderr
    signals = subprocess.run(
        [*read, "-t", "1", "-r", "6001", "-c", "10"], capture_output=True, text=True, timeout=20
    )
    levels = [line.split()[1] for line in signals.stdout.splitlines() if line.startswith("[")]
    assert levels == ["1", "1", "0", "0", "0", "0", "1", "0", "0", "0"]


def test_pendant_runs_holds_resumes_and_ends_a_program(cell: Cell) -> None:
    """The whole way of a program by its panel, with answers and exit codes."""
    assert cell.pendant("override", "50") == (0, "override 50 %\n")
    code, text = cell.pendant("run", "ARTICLE")
    assert (code, text) == (0, "ARTICLE started at override 50 %\n")
    code, text = cell.pendant("run", "TWO_POINT")
    assert code == 1 and "ARTICLE is running; first: pendant abort" in text
    assert cell.pendant("hold") == (0, "held\n")
    code, text = cell.pendant("status")
    assert code == 0
    assert "ARTICLE line" in text
    assert "paused" in text
    assert "HELD" in text
    assert "table_joint" in text
    assert cell.pendant("resume") == (0, "resumed\n")
    assert cell.pendant("abort") == (0, "aborted\n")
    code, text = cell.pendant("resume")
    assert code == 1 and "no program is paused" in text


def test_pendant_turns_the_mode_switch(cell: Cell) -> None:
    """The robot halts by it, and shows where it stands; one more turn and it is in AUTO again."""
    assert cell.pendant("run", "ARTICLE")[0] == 0
    assert cell.pendant("mode", "T1") == (0, "mode T1\n")
    code, text = cell.pendant("status")
    assert code == 0 and "mode     T1" in text and "SYST-038 Operation mode T1 Selected" in text
    assert "paused" in text and "SYSRDY" not in text
    assert cell.pendant("mode", "AUTO") == (0, "mode AUTO\n")
    assert cell.pendant("mode", "T3")[0] == 2


def test_pendant_waits_for_the_end_of_a_program(cell: Cell) -> None:
    """``run --wait`` shows the lines and ends with the program."""
    cell.pendant("override", "100")
    code, text = cell.pendant("run", "ARTICLE", "--wait")
    assert code == 0
    assert "ARTICLE line 4 running" in text and text.endswith("ARTICLE ended\n")


def test_pendant_says_what_the_override_is_beside_an_open_fence(cell: Cell) -> None:
    """It stays low, and is set anew once the fence is closed."""
    cell.client.write_coil(6002, False)
    assert cell.pendant("override", "50") == (0, "override 50 % asked for, the robot has 5 %\n")
    cell.client.write_coil(6002, True)
    assert cell.words(11044) == [5]
    assert cell.pendant("override", "50") == (0, "override 50 %\n")


def test_pendant_says_why_it_cannot(cell: Cell) -> None:
    """Unknown program, fault, wrong value, nobody there.

    One line and an exit code that is not 0.
    """
    code, text = cell.pendant("run", "NOPE")
    assert code == 1
    known = "ARTICLE, PALLETISE, RSR0101, TWO_POINT, VEHICLE"
    assert f"no program 'NOPE': there are {known}" in text
    cell.client.write_coil(6000, False)
    wait_until(lambda: cell.client.read_discrete_inputs(6005, count=1).bits[0], 2.0)
    code, text = cell.pendant("run", "ARTICLE")
    assert code == 1 and "SRVO-037 IMSTP input" in text and "pendant reset" in text
    code, text = cell.pendant("reset")
    assert code == 1 and "the fault stays" in text, "who has switched it off releases it"
    cell.client.write_coil(6000, True)
    assert cell.pendant("reset") == (0, "ready\n")
    assert cell.pendant("override", "101")[0] == 2
    lonely = cell.ros.stage.start(
        "rosrun", "fanuc_emulator", "pendant", "status", "--port", str(free_port())
    )
    assert lonely.wait(20.0) == 1 and "no robot at 127.0.0.1" in lonely.output


def test_watchdog_stops_the_robot_when_its_client_falls_silent(cell: Cell) -> None:
    """Armed by the client, then no more writes.

    The program is ended, the robot is held, the joints stand; RESET lets it go.
    """
    cell.pendant("override", "5")
    assert cell.pendant("run", "TWO_POINT")[0] == 0
    cell.client.write_register(11069, 1)
    wait_until(lambda: cell.words(11043) == [2], 5.0, "the watchdog")
    wait_until(lambda: cell.words(11210) == [0], 5.0, "the end of the program")
    assert cell.client.read_discrete_inputs(6004, count=1).bits[0]
    wait_until(lambda: cell.words(11022, 18) == [0] * 18, 5.0, "the end of the ramp")
    pose = cell.words(11001, 18)
    code, text = cell.pendant("status")
    assert code == 0 and "HELD" in text
    assert (cell.words(11001, 18), cell.words(11022, 18)) == (pose, [0] * 18)
    assert cell.pendant("reset") == (0, "ready\n")
    assert cell.words(11043) == [0]


def test_twin_controllers_link_streams_and_its_silence_stops_the_robot(cell: Cell) -> None:
    """Both ends, written apart, agree on every word: the robot goes where the set points say.

    A dead client stops it.
    """
    samples: list[RobotSample] = []
    robot = load_robot()
    settings = ModbusSettings("127.0.0.1", cell.port)
    with ModbusLink(
        settings,
        load_modbus_map(),
        robot,
        lambda sample, *_: samples.append(sample),
        lambda *_: None,
    ) as link:
        wait_until(lambda: link.connected, 10.0)
        link.send(Number("override", 100))
        link.send(Pulse("rsr1"))
        wait_until(lambda: samples[-1].control_type.name == "STREAM", 5.0)
        link.write_now((0.1, -0.2, -0.1, 0.3), 50.0)
        wait_until(
            lambda: samples[-1].motion.q == pytest.approx((0.1, -0.2, -0.1, 0.0, 0.3), abs=1e-5),
            10.0,
        )
        assert samples[-1].control_type.name == "STREAM"
        assert samples[-1].watchdog_state.name == "ARMED"
        assert link.counters.rejected == link.counters.refused == 0
        link.close(disarm=False)
    wait_until(lambda: cell.words(11043) == [2] and cell.words(11210) == [0], 5.0, "the watchdog")
    assert cell.client.read_discrete_inputs(6004, count=1).bits[0]


def test_a_taken_port_ends_the_node_with_code_2(standing: Cell) -> None:
    """The line names address and cause."""
    second = standing.ros.stage.start(
        "rosrun", "fanuc_emulator", "emulator", f"_port:={standing.port}"
    )
    assert second.wait(20.0) == 2
    assert f"cannot listen on 127.0.0.1:{standing.port}" in second.output


@pytest.mark.parametrize(
    ("argument", "text"),
    [
        ("_port:=0", "~port = 0: allowed is 1..65535"),
        ("_port:=abc", "~port = abc: allowed is 1..65535"),
        ("_config_dir:=/nowhere", "/nowhere/robot.yaml: cannot be read"),
    ],
)
def test_a_wrong_parameter_ends_the_node_with_code_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], argument: str, text: str
) -> None:
    """Wrong port or folder: one line."""
    monkeypatch.setattr(sys, "argv", ["emulator", argument])
    with pytest.raises(SystemExit) as end:
        emulator.main()
    assert end.value.code == 2
    assert text in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGTERM, *thorough(signal.SIGINT)])
def test_it_runs_without_a_roscore_and_ends_at_once(ros: Ros, number: signal.Signals) -> None:
    """No master: the robot works, says what is missing, and a signal ends it with code 0."""
    port = free_port()
    nobody = {"ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"}
    process = ros.run("fanuc_emulator", "emulator", f"_port:={port}", env=nobody)
    client: Any = ModbusTcpClient("127.0.0.1", port=port, timeout=2.0, retries=0)
    wait_until(client.connect, 20.0)
    wait_until(lambda: "no roscore yet" in process.output, 20.0)
    assert client.read_holding_registers(11018, count=1).registers == [1]
    client.close()
    process.signal(number)
    assert process.wait(3.0) == 0


def test_the_doctor_measures_how_late_a_joint_is(ros: Ros) -> None:
    """It sends the joint a hair away and back, then swings it."""
    cell = Cell(ros, "_plant:=field")
    cell.client.close()
    robot = load_robot()
    config = load_twin_controller(robot)
    with Mover(robot, load_modbus_map(), config, "127.0.0.1", cell.port) as mover:
        nudged = next(mover.nudge_all())
        assert nudged.level is Level.FINE and nudged.what.startswith("joint_1"), nudged
        fit = mover._measure(0, robot.twin_joints[0], SWING["deg"] * robot.twin_joints[0].scale)
    assert fit is not None and 0.07 < fit.delay < 0.2


@pytest.mark.thorough
def test_the_doctor_measures_how_late_each_joint_is(ros: Ros) -> None:
    """And prints what twin_controller.yaml wants: it loads, and knows the robot."""
    cell = Cell(ros, "_plant:=field")
    cell.client.close()
    doctor = ros.stage.start("rosrun", "robot_doctor", "doctor", "--port", str(cell.port), "--move")
    doctor.wait(60.0)
    found = re.findall(r"(\w+): does its set points ([\d.]+) ms late", doctor.output)
    assert [name for name, _ in found] == [name for name in NAMES if name != "joint_4"], (
        doctor.output
    )
    assert all(70.0 < float(late) < 200.0 for _, late in found), found
    line = re.search(r"response\.measured: (\{.*\})", doctor.output)
    assert line is not None, doctor.output
    measured = YAML(typ="safe").load(line.group(1))
    assert {name: entry["delay_ms"] for name, entry in measured.items()} == {
        name: float(late) for name, late in found
    }
