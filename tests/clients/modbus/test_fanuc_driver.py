"""The node of a ROS driver for real R-30iB controllers, unmodified, against the robot's stand-in.

fanuc-hmi-jointstreaming is in no package: its users clone it into a catkin workspace and build it.
`./cell test --clients` does so too. It connects to port 502, which asks for root or
CAP_NET_BIND_SERVICE.
"""

from __future__ import annotations

import math
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.tp.executor import ProgramState
from harness.clients.environments import INSTALLED, NOT_BUILT, workspace
from harness.emulated.served import running
from harness.processes import Process, wait_until
from harness.ros import Ros
from harness.workspace import ROOT
from pymodbus.client import ModbusTcpClient
from sensor_msgs.msg import JointState

SETUP = workspace("fanuc_driver")
pytestmark = pytest.mark.skipif(not SETUP, reason=NOT_BUILT)

HOST, PORT = "127.0.0.9", 502
WIRES = {3: "start", 5: "fault_reset", 6: "cstopi"}
"""What the driver's manual asks for: DO[3] is UI[6], DO[5] UI[5], DO[6] UI[4]."""
DEG = math.pi / 180.0
NAME = "fanuc-hmi-jointstreaming"


class Cabinet:
    """The robot, and the wires that the driver's manual asks for."""

    def __init__(self, loop: ServoLoop) -> None:
        self._loop = loop
        self._end = threading.Event()
        self._line = ModbusTcpClient(HOST, port=PORT, timeout=1.0)
        self._wiring = threading.Thread(target=self._wire, daemon=True)
        self._wiring.start()

    @property
    def shown(self) -> Any:
        """What can be read of the robot."""
        return self._loop.snapshot

    def switch(self, name: str, level: bool) -> None:
        """Switch an input, as somebody at the robot."""
        self._loop.post(lambda controller: controller.write_input(name, level))

    def run_stream(self) -> None:
        """Start the program that follows the set point."""
        self.switch("panel_run1", True)
        self.switch("panel_run1", False)
        wait_until(
            lambda: self.shown.program_state is ProgramState.RUNNING, 5.0, "the stream program"
        )

    def _wire(self) -> None:
        first, last = min(WIRES), max(WIRES)
        levels: dict[int, bool] = {}
        while not self._end.wait(0.01):
            bits = self._line.read_coils(first - 1, count=last - first + 1, device_id=1).bits
            for number, name in WIRES.items():
                if levels.get(number) != bits[number - first]:
                    levels[number] = bits[number - first]
                    self.switch(name, levels[number])

    def close(self) -> None:
        """Take the wires away."""
        self._end.set()
        self._wiring.join(5.0)
        self._line.close()


@pytest.fixture
def cabinet() -> Iterator[Cabinet]:
    """Run a robot at the vendor's port, its stream program running."""
    with running(address=(HOST, PORT)) as stand_in:
        cabinet = Cabinet(stand_in.loop)
        yield cabinet
        cabinet.close()


@pytest.fixture
def environment(ros: Ros) -> dict[str, str]:
    """Return a shell's environment that has sourced the driver's workspace and nothing of ours.

    uModbus, the one library that the driver installs by pip, is that of setup/clients.
    """
    (library,) = (INSTALLED / "umodbus").glob("lib/python3*/site-packages")
    kept = {name: ros.env[name] for name in ("ROS_MASTER_URI", "ROS_IP", "ROS_HOME", "ROS_LOG_DIR")}
    script = '. "$1" >&2 && env -0'
    done = subprocess.run(
        ["bash", "-c", script, "bash", SETUP],
        env=kept | {"PATH": f"{ROOT / '.venv/bin'}:/usr/bin:/bin", "PYTHONPATH": str(library)},
        capture_output=True,
        timeout=30.0,
        check=True,
    )
    return dict(item.split("=", 1) for item in done.stdout.decode().split("\0") if "=" in item)


@contextmanager
def judged(wrong: dict[str, str | None], check: str) -> Iterator[None]:
    """Note what goes wrong in a block."""
    try:
        yield
    except Exception as error:
        wrong[check] = f"{type(error).__name__}: {error}"[:200]
        raise
    wrong[check] = None


def started(ros: Ros, environment: dict[str, str]) -> Process:
    """Start the driver as its manual says, its topics below the test's namespace."""
    script = 'exec rosrun fanuc_driver fanuc_hmi_node "$@"'
    given = [f"_robot_ip:={HOST}"]
    topics = ("joint_states", "fanuc_status", "send_setpoint")
    given += [f"/{topic}:={ros.name(topic)}" for topic in topics]
    empty = dict.fromkeys(("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH", "SCARA_CONFIG_DIR"), "")
    return ros.stage.start(
        *("bash", "-c", script, "bash", *given), name="driver", env=empty | environment
    )


def test_driver_lays_out_its_registers_and_reads_joints_program_and_alarm(
    ros: Ros,
    cabinet: Cabinet,
    environment: dict[str, str],
    modbus_record: dict[tuple[str, str], dict[str, str | None]],
) -> None:
    """And streams a joint to where it is told; nothing of it is adapted."""
    version = subprocess.run(
        ["rosversion", "fanuc_driver"], env=environment, capture_output=True, text=True, check=True
    ).stdout.strip()
    wrong = modbus_record.setdefault((NAME, version), {})
    heard = ros.collect("joint_states", JointState)
    cabinet.run_stream()
    driver = started(ros, environment)

    def says(text: str) -> Callable[[], bool]:
        return lambda: text in driver.output

    def at(joint_1_deg: float) -> Callable[[], bool]:
        return lambda: bool(heard) and abs(heard[-1].position[0] - joint_1_deg * DEG) < 0.02 * DEG

    with judged(wrong, "connect"):
        wait_until(says("Successfully connected to modbus"), 20.0, "the connection")
    with judged(wrong, "programs of a driver"):
        wait_until(says("Killed all previously running"), 60.0, "the end of the program")
        assert cabinet.shown.program_state is ProgramState.ABORTED
        wait_until(says("controller startup complete"), 20.0, "the driver's start")
    with judged(wrong, "layout of a driver"), judged(wrong, "read the joints"):
        wait_until(lambda: heard, 20.0, "joint states")
        position = heard[-1].position
        # It takes joint 3 for one that turns with joint 2, and millimetres for degrees.
        assert position[:2] == pytest.approx(cabinet.shown.positions[:2], abs=1e-4)
        assert position[2] - position[1] == pytest.approx(-160.0 * DEG, abs=1e-3)
    with judged(wrong, "stream to a set point"):
        cabinet.run_stream()
        joints = f"[{5.0 * DEG}, 0, {-160.0 * DEG}, 0, 0, 0]"
        called = ("bash", "-c", 'rosservice call "$@"', "bash", ros.name("send_setpoint"), joints)
        answer = subprocess.run(
            called, env=environment, capture_output=True, text=True, timeout=30.0
        )
        assert "success: True" in answer.stdout, answer.stdout + answer.stderr
        wait_until(at(5.0), 20.0, "joint 1 at 5 deg")
        assert cabinet.shown.positions[0] == pytest.approx(5.0 * DEG, abs=1e-4)
    with judged(wrong, "alarms of a driver"):
        cabinet.switch("imstp", False)
        wait_until(says("not in whitelist"), 20.0, "an alarm that the driver does not know")
        assert "SRVO-037" in driver.output, driver.tail()
        cabinet.switch("imstp", True)
        for level in (True, False):
            cabinet.switch("fault_reset", level)
        wait_until(lambda: cabinet.shown.alarm is None, 5.0, "no alarm")
        cabinet.switch("panel_imstp", False)
        wait_until(lambda: cabinet.shown.alarm, 5.0, "the emergency stop at the panel")
        cabinet.switch("panel_imstp", True)
        wait_until(says("Alarm in whitelist, resetting"), 20.0, "the driver's own reset")
        wait_until(lambda: cabinet.shown.alarm is None, 20.0, "no alarm")
    assert driver.poll() is None, driver.tail()
