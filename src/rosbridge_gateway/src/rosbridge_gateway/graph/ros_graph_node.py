"""The gateway's ROS side: publishers, services, names; what clients hear it inherits."""

from __future__ import annotations

import concurrent.futures
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import genpy
import roslib.message
import rospy
from scara_ros.standstill import said

from rosbridge_gateway.graph.first_messages_node import Opening
from rosbridge_gateway.graph.graph_io import Ask, GraphError
from rosbridge_gateway.graph.ros_service_call_node import (
    RosServiceCall,
    ServiceTypes,
    find_service_class,
)
from rosbridge_gateway.graph.ros_subscriptions_node import BURST, RosSubscriptions
from rosbridge_gateway.protocol.audit import Entry
from rosbridge_gateway.protocol.conversion import Arrival, ConversionError, Converter, Converters
from rosbridge_gateway.protocol.first_messages import FirstOnes, KeepRules
from rosbridge_gateway.rosapi.answers import Nodes
from scara_msgs.msg import Audit, MotionCommand

_STOPS = (MotionCommand.STOP, MotionCommand.PAUSE, MotionCommand.ESTOP)


@dataclass(slots=True)
class _Publication:
    """What one client publishes.

    ``first``: the topic's first second, None if its messages are never kept.
    ``told_until``: until then (monotonic, [s]) the client is told if nobody is connected.
    ``until_stop``: its first messages are forgotten at a stop. ``drives``: its messages move a
    robot at once, and have no field that says when they were commanded.
    """

    publisher: rospy.Publisher
    converter: Converter
    first: Opening | None
    told_until: float
    until_stop: bool
    drives: bool


class RosGraph(RosSubscriptions):
    """Implements :class:`rosbridge_gateway.graph.graph_io.Graph` with rospy."""

    def __init__(
        self,
        keep_rules: KeepRules,
        stamps_itself: Callable[[str], object],
        drives: Callable[[str], object],
        unstamped_age: float,
    ) -> None:
        """Begin.

        Args:
            keep_rules: Which first messages are kept.
            stamps_itself: Tells of a topic whether its sender has to stamp its messages itself.
            drives: Tells of a topic whether its messages move a robot at once.
            unstamped_age: So old [s] such a message may be if it does not say when it was
                commanded.
        """
        super().__init__()
        # Without a clock: who drives has to say when a set point is due, and gets no stamp as a
        # present.
        self._unstamped = Converters(roslib.message.get_message_class, None)
        self._stamps_itself = stamps_itself
        self._drives, self._unstamped_age = drives, unstamped_age
        # When a stop was heard last, from whoever: what came before it moves nothing any more.
        self._stopped_at = 0.0
        self._keep_rules = keep_rules
        self._publications: dict[tuple[int, str], _Publication] = {}
        self._services: dict[str, tuple[int, rospy.Service]] = {}
        self._service_types = ServiceTypes(self._converters)
        self._audit = rospy.Publisher(
            "twin_controller/audit", Audit, queue_size=BURST, tcp_nodelay=True
        )
        rospy.Subscriber(
            "motion_command", MotionCommand, self._hear_command, queue_size=BURST, tcp_nodelay=True
        )

    def advertise(
        self, owner: int, topic: str, type_name: str | None, latch: bool, queue_size: int
    ) -> None:
        """Open a publisher for a client.

        Asynchronous, so that a slow ROS node cannot hold up the gateway.
        """
        converter = self._converter(topic, type_name)
        if self._stamps_itself(topic):
            converter = self._unstamped.by_class(converter.message_class)
        publisher = rospy.Publisher(
            topic,
            converter.message_class,
            latch=latch,
            queue_size=max(queue_size, 1),
            tcp_nodelay=True,
        )
        previous = self._publications.get((owner, topic))
        first = self._opening(publisher, topic, converter.message_class._type)
        told_until = 0.0 if first else time.monotonic() + self._keep_rules.config.seconds
        type_name = converter.message_class._type
        self._publications[owner, topic] = _Publication(
            publisher,
            converter,
            first,
            told_until,
            self._keep_rules.until_stop(topic, type_name),
            bool(self._drives(topic)) and not converter.says_when,
        )
        if previous:
            previous.publisher.unregister()

    def _opening(self, publisher: rospy.Publisher, topic: str, type_name: str) -> Opening | None:
        """Return the topic's first second; one that another client has begun is shared."""
        if not self._keep_rules.keeps(topic, type_name):
            return None
        for (_, name), other in self._publications.items():
            if name == topic and other.first is not None and other.first.is_of(publisher):
                other.first.extend()
                return other.first
        return Opening(publisher, FirstOnes(self._keep_rules.config, time.monotonic()))

    def unadvertise(self, owner: int, topic: str) -> None:
        """Close a client's publisher; it stays while subscribers may still fetch first messages."""
        publication = self._publications.pop((owner, topic))
        publisher, first = publication.publisher, publication.first
        wanted_for = first.wanted_for() if first else 0.0
        if first is None or not wanted_for:
            self._leaving.leave(publisher.unregister)
            return

        def leave() -> None:
            first.end()
            publisher.unregister()

        later = threading.Timer(wanted_for, leave)
        later.daemon = True
        later.start()

    def end_openings(self) -> None:
        """Forget first messages that nobody can get any more."""
        for publication in list(self._publications.values()):
            first = publication.first
            if first is not None and first.is_over():
                publication.first = None
                first.end()

    def _hear_command(self, command: Any) -> None:
        """Hear a stop of any node."""
        if command.command not in _STOPS:
            return
        self.stopped(command.asked if said(command.asked, now := time.monotonic()) else now)

    def stopped(self, given: float) -> None:
        """Forget goals that nobody has got yet: what comes after a stop was meant before it."""
        self._stopped_at = max(self._stopped_at, given)
        for (owner, topic), publication in list(self._publications.items()):
            first = publication.first
            if first is not None and publication.until_stop and first.forget(given):
                self.remark(owner, f"{topic}: cancelled by STOP, before it began: send it again")

    def _arrival(self, came: float) -> Arrival:
        """Return both clocks' time of what came at ``came`` (monotonic, [s])."""
        since = max(0.0, time.monotonic() - came)
        stamp = rospy.get_rostime().to_nsec() - int(since * 1e9)
        return Arrival(came, divmod(max(0, stamp), 1_000_000_000))

    def publish(self, owner: int, topic: str, values: dict[str, Any], came: float) -> str | None:
        """Publish at once; tell once if nobody was connected yet to what is never kept."""
        publication = self._publications[owner, topic]
        publisher, first = publication.publisher, publication.first
        try:
            if publication.drives:
                # What moves a robot at once may be older than a stop, and nobody behind can tell.
                if came <= self._stopped_at:
                    raise GraphError(f"{topic}: cancelled by STOP, before it began: send it again")
                waited = time.monotonic() - came
                if waited > self._unstamped_age:
                    raise GraphError(
                        f"{topic}: not sent: it waited for {waited:.2f} s in the gateway, so a "
                        "stop may have come between; send it again"
                    )
            message = publication.converter.to_message(values, self._arrival(came))
            if first is not None and first.publish(message):
                return None
            publisher.publish(message)
        except (ConversionError, rospy.ROSException, genpy.MessageException) as error:
            raise GraphError(f"{topic}: {error}") from error
        # This node listens to stops itself.
        hearers = (one.endpoint_id != rospy.get_name() for one in publisher.impl.connections)
        if time.monotonic() >= publication.told_until or any(hearers):
            return None
        publication.told_until = 0.0  # once is enough
        return (
            f"{topic}: nobody was connected yet, so this reached nobody; what moves or stops a "
            "robot is never delivered late: send it again"
        )

    def service_call(
        self, service: str, args: Any, timeout: float, caller: str, came: float
    ) -> RosServiceCall:
        """Prepare a service call.

        The service sees the client's role and address behind this node's name.
        """
        return RosServiceCall(
            self._service_types,
            service,
            args,
            timeout,
            f"{rospy.get_name()}/{caller}",
            self._arrival(came),
        )

    def advertise_service(
        self, owner: int, service: str, type_name: str, ask: Ask, timeout: float
    ) -> None:
        """Offer a service that a client answers."""
        if service in self._services:
            raise GraphError(f"service {service} is offered by a client of this gateway already")
        service_class = find_service_class(type_name)
        request, response = self._service_types.converters(service_class)

        def handle(message: Any) -> Any:
            future = ask(request.to_values(message))
            try:
                return response.to_message(future.result(timeout))
            except concurrent.futures.TimeoutError:
                future.cancel()
                raise rospy.ServiceException(
                    f"the client that answers {service} took more than {timeout:g} s"
                ) from None
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
        self._leaving.leave(self._services.pop(service)[1].shutdown)

    def audit(self, caller: str, entry: Entry) -> None:
        """Publish who did what over the web socket, beside the entries of the twin controller."""
        who = f"{rospy.get_name()}/{caller}"
        self._audit.publish(
            Audit(
                rospy.Header(stamp=rospy.get_rostime()),
                who,
                entry.what,
                entry.success,
                entry.outcome,
            )
        )

    def publishing_nodes(self, topic: str) -> list[str]:
        """Return which nodes publish ``topic`` now, this one left out."""
        return _others(self.system_state().publishers, topic)

    def offering_nodes(self, service: str) -> list[str]:
        """Return which nodes offer ``service`` now, this one left out."""
        return _others(self.system_state().services, service)


def _others(nodes: Nodes, name: str) -> list[str]:
    """Return the nodes behind ``name``, this one left out."""
    return [node for node in nodes.get(name, []) if node != rospy.get_name()]
