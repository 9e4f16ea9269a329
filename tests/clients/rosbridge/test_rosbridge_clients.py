"""Unmodified rosbridge clients against a live gateway: their documentation's examples, and ours.

`./cell test` runs roslibpy of .venv, `./cell test --clients` others too, each in an environment of
its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import rospy
from harness.clients.environments import ALL, results
from harness.clients.ros_side import RosSide
from harness.clients.rosbridge import Client, rosbridge_clients
from harness.opponents.running_gateway import RunningGateway
from harness.workspace import ROOT
from sensor_msgs.msg import JointState

from scara_msgs.srv import (
    ForwardKinematics,
    ForwardKinematicsRequest,
    ForwardKinematicsResponse,
)

HERE = Path(__file__).parent


CLIENTS = [pytest.param(client, id=client.environment.name) for client in rosbridge_clients()]
FIRST_STEPS = {"roslibpy_examples.py": "py", "roslibjs_examples.mjs": "mjs"}


@pytest.mark.parametrize("client", CLIENTS)
def test_examples_of_the_clients_documentation_work(
    gateway: RunningGateway, nodes: RosSide, run_script: Any, client: Client, record: dict[Any, Any]
) -> None:
    """Topics, services both ways, parameters, questions about the graph; nothing is adapted."""
    scripts = [HERE / script for script in client.scripts]
    found, wrong = results(run_script(client.environment, scripts, gateway.ros.namespace))
    record.setdefault(found, {}).update(wrong)
    assert {check: text for check, text in wrong.items() if text} == {}
    assert len(wrong) == client.checks


@pytest.mark.parametrize(
    "client", [one for one in CLIENTS if one.values[0].scripts[0] in FIRST_STEPS]
)
def test_script_of_ten_lines_hears_and_asks(
    gateway: RunningGateway, run_script: Any, client: Client
) -> None:
    """What docs/clients.md shows to begin with, as it stands."""

    def answer(request: ForwardKinematicsRequest) -> ForwardKinematicsResponse:
        return ForwardKinematicsResponse(success=len(request.joint_positions) == 3, elbow="righty")

    states = rospy.Publisher("/twin/joint_states", JointState, latch=True, queue_size=1)
    states.publish(JointState(name=["joint_1"], position=[0.25]))
    service = rospy.Service("/forward_kinematics", ForwardKinematics, answer)
    name = client.scripts[0].replace("examples", "first_steps")
    heard, answered = run_script(client.environment, [ROOT / "examples" / name])[-2:]
    assert "joint_1" in heard and "0.25" in heard
    assert "righty" in answered and "true" in answered.lower()
    service.shutdown()
    states.unregister()


@pytest.mark.skipif(not ALL, reason="./cell test --clients installs them")
def test_every_client_of_the_gateway_has_its_columns() -> None:
    """One that is missing would be a column less in the table."""
    names = [one.values[0].environment.name for one in CLIENTS]
    wanted = ["roslibpy_1", "roslibpy_2", "roslibjs_1", "roslibjs_2", "foxglove_player", "ros_mcp"]
    assert sorted(names) == sorted(wanted)
