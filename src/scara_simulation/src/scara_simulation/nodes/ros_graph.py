"""The gateway's ROS side: publishers, shared subscriptions, services, names."""

from __future__ import annotations

import concurrent.futures
import io
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import genpy
import msgspec
import rosgraph
import roslib.message
import rospy

from scara_simulation.io.gateway_graph import Ask, GraphError
from scara_simulation.io.ros_service import ServiceCallError, ServiceLine
from scara_simulation.rosbridge.conversion import ConversionError, Converter, Converters

_BURST = 100
_PROBE_TIMEOUT = 2.0
_LOG_PERIOD = 5.0

Deliver = Callable[[str, bytes, int | None], None]


@dataclass
class _Subscription:
    """One rospy subscriber for all clients; ``latched`` is the last message of each latching publisher."""

    converter: Converter
    owners: set[int] = field(default_factory=set)
    latched: dict[str, bytes] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    subscriber: rospy.Subscriber | None = None


class RosServiceCall:
    """One service call with a deadline, in a thread of its own."""

    def __init__(self, graph: RosGraph, service: str, args: Any, timeout: float) -> None:
        self._graph = graph
        self._service = service
        self._args = args
        self._timeout = timeout
        self._line: ServiceLine | None = None
        self._cancelled = False

    def run(self) -> dict[str, Any]:
        """Call and return the response's values.

        Raises:
            GraphError: There is no such service, it failed or was too slow.
            ConversionError: The arguments do not fit its type.
        """
        try:
            service_class = self._graph.service_class(self._service, self._timeout)
            request, response = self._graph.service_converters(service_class)
            payload = _serialise(request.to_message(self._args))
            with self._graph.open_service(self._service, self._timeout, service_class._md5sum) as self._line:
                if self._cancelled:
                    raise GraphError(f"service {self._service}: the caller has gone")
                answer = response.message_class()
                answer.deserialize(self._line.call(payload))
        except ServiceCallError as error:
            self._graph.forget_service(self._service)
            raise GraphError(str(error)) from error
        except genpy.MessageException as error:
            raise GraphError(str(error)) from error
        return response.to_values(answer)

    def cancel(self) -> None:
        """End a running call."""
        self._cancelled = True
        if self._line is not None:
            self._line.close()


class RosGraph:
    """Implements :class:`scara_simulation.io.gateway_graph.Graph` with rospy."""

    def __init__(self) -> None:
        self.deliver: Deliver = lambda topic, message, owner: None
        self.errors = 0
        """Messages that could not be converted."""
        self._master = rosgraph.Master(rospy.get_name())
        self._converters = Converters(roslib.message.get_message_class)
        self._publishers: dict[tuple[int, str], tuple[rospy.Publisher, Converter]] = {}
        self._subscriptions: dict[str, _Subscription] = {}
        self._services: dict[str, tuple[int, rospy.Service]] = {}
        self._service_classes: dict[str, Any] = {}

    def advertise(self, owner: int, topic: str, type_name: str | None, latch: bool, queue_size: int) -> None:
        """Open a publisher for a client; asynchronous, so that a slow ROS node cannot hold up the gateway."""
        converter = self._converter(topic, type_name)
        publisher = rospy.Publisher(topic, converter.message_class, latch=latch, queue_size=max(queue_size, 1), tcp_nodelay=True)
        previous = self._publishers.get((owner, topic))
        self._publishers[owner, topic] = (publisher, converter)
        if previous:
            previous[0].unregister()

    def unadvertise(self, owner: int, topic: str) -> None:
        """Close a client's publisher."""
        publisher, _ = self._publishers.pop((owner, topic))
        publisher.unregister()

    def publish(self, owner: int, topic: str, values: dict[str, Any]) -> None:
        """Publish at once."""
        publisher, converter = self._publishers[owner, topic]
        try:
            publisher.publish(converter.to_message(values))
        except (rospy.ROSException, genpy.MessageException) as error:
            raise GraphError(f"{topic} cannot be published: {error}") from error

    def subscribe(self, owner: int, topic: str, type_name: str | None) -> None:
        """Share one rospy subscriber; a late comer gets the latched messages at once."""
        shared = self._subscriptions.get(topic)
        if shared is None:
            shared = _Subscription(self._converter(topic, type_name))
            self._subscriptions[topic] = shared
            shared.owners.add(owner)
            shared.subscriber = rospy.Subscriber(
                topic, shared.converter.message_class, self._received, (topic, shared), queue_size=_BURST, tcp_nodelay=True
            )
            return
        self._converter(topic, type_name or shared.converter.message_class._type)
        with shared.lock:
            if owner not in shared.owners:
                shared.owners.add(owner)
                for message in shared.latched.values():
                    self.deliver(topic, message, owner)

    def unsubscribe(self, owner: int, topic: str) -> None:
        """Leave a shared subscriber; the last one closes it."""
        shared = self._subscriptions[topic]
        with shared.lock:
            shared.owners.discard(owner)
        if not shared.owners and shared.subscriber is not None:
            del self._subscriptions[topic]
            shared.subscriber.unregister()

    def _received(self, message: Any, context: tuple[str, _Subscription]) -> None:
        """Convert and encode a message once, in rospy's thread."""
        topic, shared = context
        try:
            body = msgspec.json.encode(shared.converter.to_values(message))
        except Exception as error:
            self.errors += 1
            rospy.logerr_throttle(_LOG_PERIOD, f"gateway: a message of {topic} cannot be converted: {error!r}")
            return
        header = message._connection_header or {}
        with shared.lock:
            if header.get("latching") == "1":
                shared.latched[header.get("callerid", "")] = body
            self.deliver(topic, body, None)

    def service_call(self, service: str, args: Any, timeout: float) -> RosServiceCall:
        """Prepare a service call."""
        return RosServiceCall(self, service, args, timeout)

    def open_service(self, service: str, timeout: float, md5sum: str | None = None) -> ServiceLine:
        """Connect to a service; without ``md5sum`` only to ask for its type.

        Raises:
            GraphError: There is none of that name, or no master.
            ServiceCallError: It cannot be reached.
        """
        try:
            uri = rosgraph.Master(rospy.get_name()).lookupService(service)
        except rosgraph.MasterError as error:
            raise GraphError(f"service {service} does not exist") from error
        except OSError as error:
            raise GraphError(f"service {service}: roscore does not answer: {error}") from error
        return ServiceLine(service, uri, rospy.get_name(), timeout, md5sum)

    def service_class(self, service: str, timeout: float) -> Any:
        """Return the class of a service's type, asked for at its first call."""
        if service not in self._service_classes:
            with self.open_service(service, timeout) as line:
                self._service_classes[service] = find_service_class(line.type)
        return self._service_classes[service]

    def forget_service(self, service: str) -> None:
        """Ask for its type again at the next call: it may have been started anew with another one."""
        self._service_classes.pop(service, None)

    def service_converters(self, service_class: Any) -> tuple[Converter, Converter]:
        """Return the converters of a service's request and response."""
        return self._converters.by_class(service_class._request_class), self._converters.by_class(service_class._response_class)

    def advertise_service(self, owner: int, service: str, type_name: str, ask: Ask, timeout: float) -> None:
        """Offer a service that a client answers."""
        if service in self._services:
            raise GraphError(f"service {service} is offered by a client of this gateway already")
        service_class = find_service_class(type_name)
        request, response = self.service_converters(service_class)

        def handle(message: Any) -> Any:
            future = ask(request.to_values(message))
            try:
                return response.to_message(future.result(timeout))
            except concurrent.futures.TimeoutError:
                future.cancel()
                raise rospy.ServiceException(f"the client that answers {service} took more than {timeout:g} s") from None
            except (GraphError, ConversionError) as error:
                raise rospy.ServiceException(str(error)) from error

        try:
            offered = rospy.Service(service, service_class, handle)
        except rospy.ROSException as error:
            raise GraphError(f"service {service} cannot be offered: {error}") from error
        self._services[service] = (owner, offered)

    def unadvertise_service(self, owner: int, service: str) -> None:
        """Offer it no more."""
        if self._services.get(service, (None, None))[0] != owner:
            raise GraphError(f"service {service} is not offered by this client")
        self._services.pop(service)[1].shutdown()

    def now(self) -> tuple[int, int]:
        """Return ROS time."""
        now = rospy.get_rostime()
        return now.secs, now.nsecs

    def topics(self) -> dict[str, str]:
        """Return topics and their types."""
        return dict(self._ask_master(self._master.getTopicTypes))

    def services(self) -> list[str]:
        """Return services."""
        _, _, services = self._ask_master(self._master.getSystemState)
        return sorted(name for name, _ in services)

    def service_type(self, service: str) -> str:
        """Return the type of a service, empty if there is none."""
        try:
            with self.open_service(service, _PROBE_TIMEOUT) as line:
                return line.type
        except (GraphError, ServiceCallError):
            return ""

    def _ask_master(self, function: Callable[[], Any]) -> Any:
        try:
            return function()
        except (OSError, rosgraph.MasterError) as error:
            raise GraphError(f"roscore does not answer: {error}") from error

    def _converter(self, topic: str, type_name: str | None) -> Converter:
        """Return the converter for a topic; the type must agree with what the graph knows."""
        known = self.topics().get(topic)
        known = None if known == "*" else known
        if type_name is None and known is None:
            raise GraphError(f"the type of {topic} is not known: advertise it, or give `type`")
        if type_name is not None and known is not None and type_name != known:
            raise GraphError(f"{topic} has type {known}, not {type_name}")
        return self._converters.by_name(known or type_name or "")


def find_service_class(type_name: str) -> Any:
    """Return the class of ``package/Type``.

    Raises:
        GraphError: The type is unknown here.
    """
    try:
        found = roslib.message.get_service_class(type_name)
    except ValueError as error:
        raise GraphError(f"unknown service type {type_name!r}: {error}") from error
    if found is None:
        raise GraphError(f"unknown service type {type_name!r}: no package on this machine has it")
    return found


def _serialise(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
