"""One subscriber of ROS for all clients, without a ROS graph."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from rosbridge_gateway.graph import ros_subscriptions_node
from rosbridge_gateway.graph.graph_io import GraphError
from rosbridge_gateway.graph.ros_subscriptions_node import RosSubscriptions
from rosbridge_gateway.wire.outgoing import Form
from std_msgs.msg import Bool, String

BOOL, STRING = "std_msgs/Bool", "std_msgs/String"
FORM = Form("t", "none", None)


class Line:
    """Stands for a subscriber of rospy."""

    def __init__(self, kind: type[Any], hear: Callable[[Any], None], close: Any) -> None:
        self.kind, self.hear, self._close = kind, hear, close
        self.impl = SimpleNamespace(connections=[])

    def unregister(self) -> None:
        """End it."""
        self._close(self)


class Graph(RosSubscriptions):
    """A graph whose master knows what the test says."""

    def __init__(self) -> None:
        super().__init__()
        self.types: dict[str, str] = {}
        self.lines: list[Line] = []
        """The subscribers that are open."""
        self.delivered: list[int | None] = []
        """To whom messages went, None for all."""
        self.remarks: list[tuple[int, str]] = []
        self.deliver = lambda topic, message, owner: self.delivered.append(owner)
        self.remark = lambda owner, text: self.remarks.append((owner, text))

    def topic_types(self) -> dict[str, str]:
        """Return the types."""
        return self.types

    def open_line(
        self, topic: str, kind: type[Any], heard: Callable[..., None], context: Any, **_: Any
    ) -> Line:
        """Stand for rospy.Subscriber, which has one type for all subscribers of a topic."""
        assert not self.lines
        self.lines.append(Line(kind, lambda message: heard(message, context), self.lines.remove))
        return self.lines[-1]


def said(text: str, **header: str) -> Any:
    """Return a message as rospy hands it over."""
    message = String(text)
    message._connection_header = header
    return message


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Graph:
    """Return one without topics."""
    made = Graph()
    now = SimpleNamespace(secs=1, nsecs=2)
    rospy = SimpleNamespace(Subscriber=made.open_line, get_rostime=lambda: now)
    monkeypatch.setattr(ros_subscriptions_node, "rospy", rospy)
    return made


@pytest.mark.parametrize("kind", [STRING, None])
def test_right_type_is_heard_behind_a_wrong_one(graph: Graph, kind: str | None) -> None:
    """Nobody published when the first came; it is told what it hears now."""
    graph.subscribe(1, "/t", BOOL, FORM)
    (wrong,) = graph.lines
    graph.types["/t"] = STRING
    graph.subscribe(2, "/t", kind, FORM)
    (line,) = graph.lines
    assert (wrong.kind, line.kind) == (Bool, String)
    line.hear(said("x"))
    wrong.hear(Bool(True))
    assert graph.delivered == [None], "and nothing of the wrong type that was on its way"
    told = f"/t has type {STRING}, not {BOOL}: it comes as {STRING} now"
    assert graph.remarks == [(1, told)]
    for owner in (1, 2):
        assert graph.lines == [line]
        graph.unsubscribe(owner, "/t")
    assert graph.lines == []


def test_type_of_the_first_counts_while_the_graph_knows_none(graph: Graph) -> None:
    """Two clients cannot both be right; who names no type joins."""
    graph.subscribe(1, "/t", BOOL, FORM)
    with pytest.raises(GraphError, match=f"/t has type {BOOL}, not {STRING}"):
        graph.subscribe(2, "/t", STRING, FORM)
    graph.subscribe(3, "/t", None, FORM)
    (line,) = graph.lines
    graph.unsubscribe(1, "/t")
    assert graph.lines == [line] and graph.remarks == []


def test_each_subscription_of_a_client_gets_the_latched_message(graph: Graph) -> None:
    """As with rosbridge_server: another part of a page hears it too. A change of form is none."""
    graph.types["/t"] = STRING
    graph.subscribe(1, "/t", None, FORM)
    (line,) = graph.lines
    line.impl.connections.append(SimpleNamespace(callerid_pub="/talker"))
    line.hear(said("kept", latching="1", callerid="/talker"))
    graph.subscribe(1, "/t", STRING, FORM)
    assert graph.delivered == [None, 1]
    graph.change_form(1, "/t", Form("/t", "cbor", None))
    assert graph.delivered == [None, 1]
    line.impl.connections.clear()
    graph.subscribe(1, "/t", STRING, FORM)
    assert graph.delivered == [None, 1], "it goes with its publisher"
