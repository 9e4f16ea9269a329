"""Both sides of a gateway: a stand-in for the ROS graph, and web-socket clients."""

from __future__ import annotations

import queue
import threading
import xmlrpc.client
from collections.abc import Callable
from typing import Any

import roslib.message
from rosbridge_gateway.config import GatewayConfig, load_gateway_config
from rosbridge_gateway.connection.server_io import GatewayServer
from rosbridge_gateway.graph.graph_io import Ask, GraphError
from rosbridge_gateway.protocol.audit import Entry
from rosbridge_gateway.protocol.packets import encode_publish
from rosbridge_gateway.rosapi.answers import SystemState
from rosbridge_gateway.rosapi.parameters import ParameterServer
from rosbridge_gateway.rosapi.typedefs import FindClass
from rosbridge_gateway.wire.outgoing import Form, Frames

from harness.processes import wait_until
from harness.wires.gateway_client import RosbridgeClient, connect
from harness.workspace import ROOT

DEADLINE = 5.0
SHIPPED = load_gateway_config(ROOT / "config")
TAKES = SHIPPED.roles["operator"].takes
TWIN_CONTROLLER = "twin-controller-of-the-tests-0123456789"
TOKENS = {
    "look": "viewer",
    "drive": "operator",
    TWIN_CONTROLLER: "twin_controller",
    "fitters-own": "operator",
}
PERSONS = {"fitters-own": "fitter"}


class JsonMessage:
    """A message that is JSON already, whatever form is asked for."""

    def __init__(self, body: bytes) -> None:
        self._body = body

    def frames(self, form: Form) -> Frames:
        """Return its packet."""
        return Frames((encode_publish(form.topic, self._body),))


class Call:
    """A service call that begins at once, or when the test says so, and ends when it says so."""

    def __init__(self, service: str, args: Any, timeout: float, caller: str, came: float) -> None:
        self.service = service
        self.came = came
        self.started, self.may_begin = threading.Event(), threading.Event()
        self.args = args
        self.timeout = timeout
        self.caller = caller
        self.end: queue.Queue[dict[str, Any] | Exception] = queue.Queue()
        self.cancelled = threading.Event()

    def run(self, begun: Callable[[], None]) -> dict[str, Any]:
        """Wait for the test."""
        self.started.set()
        if "slow_to_begin" in self.service:
            assert self.may_begin.wait(DEADLINE)
        begun()
        outcome = self.end.get(timeout=DEADLINE)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def cancel(self) -> None:
        """End as a broken connection would."""
        self.may_begin.set()
        self.cancelled.set()
        self.end.put(GraphError("cancelled"))


class Graph:
    """Notes what the gateway asks of ROS."""

    def __init__(self) -> None:
        self.done: queue.Queue[tuple[Any, ...]] = queue.Queue()
        self.calls: queue.Queue[Call] = queue.Queue()
        self.stops: list[float] = []
        self.asks: dict[str, Ask] = {}
        self.forms: dict[tuple[int, str], Form] = {}
        """How each client wants each topic."""
        self.publishers: dict[str, list[str]] = {}
        """Nodes that publish a topic natively."""
        self.providers: dict[str, list[str]] = {}
        """Nodes that offer a service natively."""
        self.parameters: ParameterServer = Parameters()
        self.find_message: FindClass = roslib.message.get_message_class
        self.find_service: FindClass = roslib.message.get_service_class
        self.audited: queue.Queue[tuple[str, Entry]] = queue.Queue()

    def publishing_nodes(self, topic: str) -> list[str]:
        """Return what the test says."""
        return self.publishers.get(topic, [])

    def offering_nodes(self, service: str) -> list[str]:
        """Return what the test says."""
        return self.providers.get(service, [])

    def advertise(
        self, owner: int, topic: str, type_name: str | None, latch: bool, queue_size: int
    ) -> None:
        """Know all types."""
        self.done.put(("advertise", owner, topic, type_name, latch, queue_size))

    def unadvertise(self, owner: int, topic: str) -> None:
        """Note it."""
        self.done.put(("unadvertise", owner, topic))

    def publish(self, owner: int, topic: str, values: dict[str, Any], came: float) -> str | None:
        """Refuse one value, break at another, remark on a third."""
        if values.get("data") == "refuse":
            raise GraphError("data = 'refuse': allowed: anything else")
        if values.get("data") == "break":
            raise KeyError("a bug")
        self.done.put(("publish", owner, topic, values))
        return "nobody was connected yet" if values.get("data") == "too early" else None

    def stopped(self, given: float) -> None:
        """Note it."""
        self.stops.append(given)

    def subscribe(self, owner: int, topic: str, type_name: str | None, form: Form) -> None:
        """Know no topic called unknown."""
        if topic.endswith("/unknown"):
            raise GraphError(f"the type of {topic} is not known")
        self.forms[owner, topic] = form
        self.done.put(("subscribe", owner, topic, type_name))

    def change_form(self, owner: int, topic: str, form: Form) -> None:
        """Note it."""
        self.forms[owner, topic] = form

    def unsubscribe(self, owner: int, topic: str) -> None:
        """Note it."""
        self.done.put(("unsubscribe", owner, topic))

    def service_call(
        self, service: str, args: Any, timeout: float, caller: str, came: float
    ) -> Call:
        """Hand the call to the test."""
        call = Call(service, args, timeout, caller, came)
        self.calls.put(call)
        return call

    def advertise_service(
        self, owner: int, service: str, type_name: str, ask: Ask, timeout: float
    ) -> None:
        """Keep the way to the client."""
        self.asks[service] = ask
        self.done.put(("advertise_service", owner, service, type_name))

    def unadvertise_service(self, owner: int, service: str) -> None:
        """Note it."""
        self.done.put(("unadvertise_service", owner, service))

    def audit(self, caller: str, entry: Entry) -> None:
        """Note it."""
        self.audited.put((caller, entry))

    def now(self) -> tuple[int, int]:
        """Return a time."""
        return 12, 34

    def topic_types(self) -> dict[str, str]:
        """Return one topic."""
        return {"/clock": "rosgraph_msgs/Clock"}

    def system_state(self) -> SystemState:
        """Return who uses it."""
        return SystemState({"/clock": ["/simulator"]}, {"/clock": ["/listener"]}, {})

    def service_types(self, services: list[str]) -> dict[str, str]:
        """Know none."""
        return dict.fromkeys(services, "")

    def service_address(self, service: str) -> str:
        """Know none."""
        return ""

    def helped(self) -> float:
        """Say that nobody helped."""
        return 0.0


class Parameters:
    """A parameter server in memory; names as they are written."""

    def __init__(self, values: dict[str, Any] | None = None) -> None:
        self.values: dict[str, Any] = values or {}

    def get(self, name: str) -> Any:
        """Return a value."""
        return self.values[name]

    def set(self, name: str, value: Any) -> None:
        """Refuse null wherever it stands, and long integers, as XML-RPC does."""
        try:
            xmlrpc.client.dumps((value,))
        except (TypeError, OverflowError) as error:
            raise ValueError(str(error)) from error
        self.values[name] = value

    def has(self, name: str) -> bool:
        """Return whether it is set."""
        return name in self.values

    def search(self, name: str) -> str:
        """Look at the root only."""
        return f"/{name}" if f"/{name}" in self.values else ""

    def delete(self, name: str) -> None:
        """Forget it."""
        self.values.pop(name, None)

    def names(self) -> list[str]:
        """Return all."""
        return list(self.values)


class Cell:
    """A running gateway, its graph, its log and its clients."""

    def __init__(self, config: GatewayConfig) -> None:
        self.graph = Graph()
        self.log: list[str] = []
        self.server = GatewayServer(config, self.graph, "/cell", TOKENS, self.log.append, PERSONS)
        self._clients: list[RosbridgeClient] = []

    def client(self, path: str = "", **options: Any) -> RosbridgeClient:
        """Connect; as a program does, without an origin, unless ``origin`` is given."""
        self._clients.append(connect(self.server.port, DEADLINE, path, **options))
        return self._clients[-1]

    def deliver(self, topic: str, body: bytes, owner: int | None = None) -> None:
        """Hand a message over as ROS does; ``body`` is its JSON text."""
        self.server.deliver(topic, JsonMessage(body), owner)

    def wait_logged(self, text: str) -> None:
        """Wait for a line of the log that holds ``text``: a farewell comes behind its deed."""
        wait_until(lambda: any(text in line for line in self.log), DEADLINE, f"log: {text}")

    def close(self) -> None:
        """End clients and gateway."""
        for client in self._clients:
            client.line.close(timeout=0.1)
        self.server.stop()


MakeCell = Callable[..., Cell]
