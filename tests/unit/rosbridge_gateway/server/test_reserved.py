"""Names of the cell's own nodes and of living ones: no client takes them."""

from __future__ import annotations

from typing import Any

import pytest
from harness.opponents.graph_and_clients import DEADLINE, TWIN_CONTROLLER, Cell

AS_TWIN_CONTROLLER = [f"Authorization: Bearer {TWIN_CONTROLLER}"]


@pytest.mark.parametrize("op", ["publish", "advertise"])
def test_operator_cannot_publish_as_the_cells_own_nodes(cell: Cell, op: str) -> None:
    """Refused with name and reason, and told in the audit; each name is in test_roles.py."""
    client, topic = cell.client(), "twin_controller/state"
    more: dict[str, Any] = {"msg": {}} if op == "publish" else {"type": "std_msgs/String"}
    answer = client.ask(op=op, id="x", topic=topic, **more)
    reason = f"/cell/{topic} is published by the cell's own nodes only"
    assert answer == {"op": "status", "id": "x", "level": "error", "msg": reason}
    caller, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert caller.startswith("operator@127.0.0.1:") and not entry.success
    assert (entry.what.split()[:2], entry.outcome) == ([op, topic], reason)
    client.time()
    assert cell.graph.done.empty()


def test_operator_cannot_offer_a_service_of_the_cell(cell: Cell) -> None:
    """Else the next STOP goes to the client, and afterwards nowhere."""
    client, service = cell.client(), "twin_controller/command"
    answer = client.ask(op="advertise_service", id="x", service=service, type="std_srvs/Trigger")
    reason = f"/cell/{service} is offered by the cell's own nodes only"
    assert answer == {"op": "status", "id": "x", "level": "error", "msg": reason}
    _, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert not entry.success and entry.outcome == reason
    client.time()
    assert cell.graph.done.empty()


def test_service_that_a_node_offers_cannot_be_offered_over_it(cell: Cell) -> None:
    """For the ROS master the last offer counts, and when it ends there is none."""
    cell.graph.providers["/cell/lamp"] = ["/cabinet"]
    client = cell.client()
    answer = client.ask(op="advertise_service", service="lamp", type="std_srvs/Trigger")
    assert answer["msg"] == "/cell/lamp is offered by /cabinet already"
    _, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert not entry.success and entry.outcome == answer["msg"]
    client.line.close()
    assert cell.client().time()["result"] and cell.graph.done.empty()


@pytest.mark.parametrize("op", ["publish", "advertise"])
def test_topic_that_a_node_publishes_cannot_be_published_beside_it(cell: Cell, op: str) -> None:
    """A listener could not tell the two apart."""
    cell.graph.publishers["/cell/measured"] = ["/a", "/b", "/c", "/d"]
    client = cell.client()
    more: dict[str, Any] = {"msg": {}} if op == "publish" else {"type": "std_msgs/String"}
    answer = client.ask(op=op, topic="measured", **more)
    assert answer["msg"] == "/cell/measured is published by /a, /b, /c and 1 more already"
    assert cell.graph.done.empty()


def test_command_may_be_given_by_several(cell: Cell) -> None:
    """Nodes of the cell publish some of these too; STOP must always get through."""
    topic = "motion_command"
    cell.graph.publishers[f"/cell/{topic}"] = ["/motion_server"]
    cell.client().say(op="publish", topic=topic, msg={})
    assert cell.graph.done.get(timeout=DEADLINE)[:3] == ("advertise", 1, f"/cell/{topic}")
    assert cell.graph.done.get(timeout=DEADLINE) == ("publish", 1, f"/cell/{topic}", {})


def test_twin_controller_alone_leads_the_twin(cell: Cell) -> None:
    """Its own connection may, also beside the trajectory server; as anybody else it may not."""
    name = "/cell/joint_pose_controller/follow"
    cell.graph.publishers[name] = ["/trajectory_server"]
    client = cell.client(header=AS_TWIN_CONTROLLER)
    client.say(op="publish", topic="joint_pose_controller/follow", msg={})
    assert cell.graph.done.get(timeout=DEADLINE)[:3] == ("advertise", 1, name)
    assert cell.graph.done.get(timeout=DEADLINE) == ("publish", 1, name, {})
    answer = client.ask(op="publish", topic="twin_controller/state", msg={})
    assert "by the cell's own nodes only" in answer["msg"]
