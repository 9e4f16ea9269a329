"""Unmodified roslibpy against a live gateway: its documentation's examples, and our own.

`./cell test` runs the version in .venv, `./cell test --clients` each in a venv of its own.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros
from harness.workspace import ROOT
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

from scara_msgs.srv import (
    ForwardKinematics,
    ForwardKinematicsRequest,
    ForwardKinematicsResponse,
)

EXAMPLES = Path(__file__).with_name("roslibpy_examples.py")
FIRST_STEPS = ROOT / "examples" / "roslibpy_first_steps.py"
PAGE = os.environ.get("CELL_CLIENTS_PAGE")
VENVS = sorted((ROOT / ".venv" / "clients").glob("roslibpy_*/bin/python"))
PYTHONS = [str(venv) for venv in VENVS] if PAGE else [sys.executable]
CHECKS = EXAMPLES.read_text(encoding="utf-8").count("    def check_")


class OtherNodes:
    """The ROS side of the examples."""

    def __init__(self, ros: Ros) -> None:
        self._ros = ros
        self._lamp = rospy.ServiceProxy(ros.name("lamp"), SetBool)
        self._used = rospy.Publisher(ros.name("lamp_used"), String, queue_size=1)
        self._answer = rospy.Publisher(ros.name("answer"), String, queue_size=1)
        states = rospy.Publisher(ros.name("states"), JointState, queue_size=1)
        self._handles: list[Any] = [
            *(self._used, self._answer, states),
            rospy.Subscriber(ros.name("question"), String, self._answer.publish),
            rospy.Subscriber(ros.name("use_lamp"), String, self._use_lamp),
        ]
        self._switch = rospy.Service(ros.name("switch"), SetBool, self._switched)
        self._stop = threading.Event()
        self._publishing = threading.Thread(target=self._publish, args=(states,))
        self._publishing.start()

    def close(self) -> None:
        """Leave."""
        self._stop.set()
        self._publishing.join()
        self._switch.shutdown()
        for handle in self._handles:
            handle.unregister()

    def _publish(self, states: rospy.Publisher) -> None:
        while not self._stop.wait(0.05):
            states.publish(JointState(name=["joint_1"], position=[0.5]))

    def _switched(self, request: SetBoolRequest) -> SetBoolResponse:
        return SetBoolResponse(True, "on" if request.data else "off")

    def _use_lamp(self, _: String) -> None:
        try:
            answer = self._lamp(True)
            self._used.publish(f"{answer.success} {answer.message}")
        except rospy.ServiceException as error:
            self._used.publish(f"failed: {error}")


@pytest.fixture(scope="module")
def gateway(ros_module: Ros) -> RunningGateway:
    """Start one gateway for the tests of this module."""
    return RunningGateway(ros_module)


@pytest.fixture
def nodes(gateway: RunningGateway) -> Iterator[OtherNodes]:
    """Start the ROS side."""
    others = OtherNodes(gateway.ros)
    yield others
    others.close()


def run(gateway: RunningGateway, python: str, script: Path, *args: str) -> list[str]:
    """Run a client's script to its end and return its lines; no path of ours leads it to ours."""
    env = {"PYTHONPATH": ""} if PAGE else None
    client = gateway.ros.stage.start(python, str(script), str(gateway.port), *args, env=env)
    assert client.wait(60.0) == 0, client.tail()
    return client.output.splitlines()


@pytest.mark.parametrize("python", PYTHONS)
def test_examples_of_roslibpys_documentation_work(
    gateway: RunningGateway, nodes: OtherNodes, python: str, record: dict[Any, Any]
) -> None:
    """Topics, services both ways, parameters, questions about the graph; nothing is adapted."""
    lines = run(gateway, python, EXAMPLES, gateway.ros.namespace)
    found = [json.loads(line) for line in lines if line.startswith("{")]
    wrong = {one["check"]: one["wrong"] for one in found[1:]}
    record[found[0]["client"], found[0]["version"]] = wrong
    assert len(wrong) == CHECKS
    assert {check: text for check, text in wrong.items() if text} == {}


@pytest.mark.parametrize("python", PYTHONS)
def test_script_of_ten_lines_hears_and_asks(gateway: RunningGateway, python: str) -> None:
    """What docs/clients.md shows to begin with, as it stands."""

    def answer(request: ForwardKinematicsRequest) -> ForwardKinematicsResponse:
        return ForwardKinematicsResponse(success=len(request.joint_positions) == 3, elbow="righty")

    states = rospy.Publisher("/twin/joint_states", JointState, latch=True, queue_size=1)
    states.publish(JointState(name=["joint_1"], position=[0.25]))
    service = rospy.Service("/forward_kinematics", ForwardKinematics, answer)
    heard, answered = run(gateway, python, FIRST_STEPS)[-2:]
    assert heard == "['joint_1'] [0.25]"
    assert "'success': True" in answered and "'elbow': 'righty'" in answered
    service.shutdown()
    states.unregister()


def test_every_version_of_a_client_has_its_venv() -> None:
    """One that is missing would be a column less in the table."""
    if PAGE:
        wanted = sorted(file.stem for file in (ROOT / "setup" / "clients").glob("roslibpy_*.txt"))
        assert [venv.parents[1].name for venv in VENVS] == wanted
