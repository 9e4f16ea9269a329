"""What the gateway asks of the ROS side; the node implements it, tests replace it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol

from rosbridge_gateway.protocol.audit import Entry
from rosbridge_gateway.rosapi.answers import GraphView
from rosbridge_gateway.wire.outgoing import Form, Frames


class GraphError(RuntimeError):
    """The ROS graph cannot do what was asked; the text says why and goes to the client."""


class ServiceCall(Protocol):
    """A service call that can be ended from another thread."""

    def run(self, begun: Callable[[], None]) -> dict[str, Any]:
        """Call and return the response's values; raises GraphError or ConversionError.

        ``begun`` is called once the request has gone to its service; from then on what is asked
        later cannot pass it.
        """

    def cancel(self) -> None:
        """End a running call."""


class Message(Protocol):
    """One message of a topic."""

    def frames(self, form: Form) -> Frames:
        """Return it in the form that a client wants; callable from any thread."""


Ask = Callable[[dict[str, Any]], "Future[dict[str, Any]]"]


class Graph(GraphView, Protocol):
    """The ROS side.

    All run in one thread of their own, in order, but ``publish``, ``now``, ``service_call``,
    ``helped`` and what rosapi asks.
    """

    def publishing_nodes(self, topic: str) -> list[str]:
        """Return which nodes publish ``topic`` now, this one left out."""

    def offering_nodes(self, service: str) -> list[str]:
        """Return which nodes offer ``service`` now, this one left out."""

    def helped(self) -> float:
        """Return the processor time [s] of other threads for this one since it asked last."""

    def advertise(
        self, owner: int, topic: str, type_name: str | None, latch: bool, queue_size: int
    ) -> None:
        """Open a publisher for a client; without a type the graph must know it."""

    def unadvertise(self, owner: int, topic: str) -> None:
        """Close a client's publisher."""

    def publish(self, owner: int, topic: str, values: dict[str, Any], came: float) -> str | None:
        """Publish at once; called in the event loop, must not block.

        Args:
            owner: The client.
            topic: Absolute name.
            values: The message.
            came: When the packet came (monotonic, [s]).

        Returns:
            A remark for the client, or None.
        """

    def stopped(self, given: float) -> None:
        """Note that a stop was given then (monotonic, [s]); called in the event loop."""

    def subscribe(self, owner: int, topic: str, type_name: str | None, form: Form) -> None:
        """Deliver ``topic`` in ``form`` from now on, latched messages included.

        Again for the same client: the same, in the form that it wants now.
        """

    def change_form(self, owner: int, topic: str, form: Form) -> None:
        """Deliver ``topic`` to this client in another form from now on, and nothing once more."""

    def unsubscribe(self, owner: int, topic: str) -> None:
        """Deliver ``topic`` to this client no more."""

    def service_call(
        self, service: str, args: Any, timeout: float, caller: str, came: float
    ) -> ServiceCall:
        """Prepare a service call in the name of ``caller``; it runs in a thread of its own.

        ``came``: when the packet came (monotonic, [s]).
        """

    def advertise_service(
        self, owner: int, service: str, type_name: str, ask: Ask, timeout: float
    ) -> None:
        """Offer a service whose requests a client answers."""

    def unadvertise_service(self, owner: int, service: str) -> None:
        """Offer it no more."""

    def audit(self, caller: str, entry: Entry) -> None:
        """Tell what ``caller`` did; called in the event loop, must not block."""

    def now(self) -> tuple[int, int]:
        """Return ROS time: seconds, nanoseconds."""
