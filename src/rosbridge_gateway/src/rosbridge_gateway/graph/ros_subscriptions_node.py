"""What clients hear of the ROS graph: one subscriber for all of them."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import roslib.message
import rospy

from rosbridge_gateway.graph.graph_io import GraphError, Message
from rosbridge_gateway.graph.leaving_io import Leaving
from rosbridge_gateway.graph.ros_view_node import RosView
from rosbridge_gateway.protocol.conversion import Converter, Converters
from rosbridge_gateway.wire.outgoing import Form, Outgoing
from rosbridge_gateway.wire.ros_encoders_node import RosEncoders

BURST = 100
"""So many messages of a topic may wait in rospy: our choice."""
_LOG_PERIOD = 5.0

Deliver = Callable[[str, Message, int | None], None]
Remark = Callable[[int, str], None]
"""Takes a client and a remark for it."""


@dataclass
class _Subscription:
    """One rospy subscriber for all clients.

    ``forms``: how each client wants the messages; ``latched``: the last message of each latching
    publisher.
    """

    converter: Converter
    forms: dict[int, Form]
    latched: dict[str, Outgoing] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)
    subscriber: Any = None


class RosSubscriptions(RosView):
    """The part of :class:`rosbridge_gateway.graph.graph_io.Graph` that clients hear."""

    def __init__(self) -> None:
        super().__init__()
        self.deliver: Deliver = lambda topic, message, owner: None
        self.remark: Remark = lambda owner, text: None
        self.errors = 0
        """Messages that could not be converted."""
        self._converters = Converters(roslib.message.get_message_class, self.now)
        self._encoders = RosEncoders(self._converters)
        self._numbers = itertools.count(1)
        self._subscriptions: dict[str, _Subscription] = {}
        self._leaving = Leaving()

    def subscribe(self, owner: int, topic: str, type_name: str | None, form: Form) -> None:
        """Share one rospy subscriber; each subscription gets the latched messages at once.

        Made anew where the graph knows another type by now: who came before the first publisher
        may have been wrong about it, and has heard nothing.
        """
        shared = self._subscriptions.get(topic)
        if shared is None:
            self._share(topic, self._converter(topic, type_name), {owner: form})
            return
        held = shared.converter.message_class._type
        converter = self._converter(topic, type_name, held)
        if converter is not shared.converter:
            with shared.lock:
                forms, shared.forms = shared.forms, {}
            # First: rospy has one type for all subscribers of a topic.
            self._leaving.leave(shared.subscriber.unregister)
            self._share(topic, converter, {**forms, owner: form})
            kind = converter.message_class._type
            for other in forms.keys() - {owner}:
                self.remark(other, f"{topic} has type {kind}, not {held}: it comes as {kind} now")
            return
        with shared.lock:
            shared.forms[owner] = form
            alive = {connection.callerid_pub for connection in shared.subscriber.impl.connections}
            for caller, message in shared.latched.items():
                if caller in alive:
                    message.frames(form)
                    self.deliver(topic, message, owner)

    def _share(self, topic: str, converter: Converter, forms: dict[int, Form]) -> None:
        """Open the subscriber of these clients."""
        shared = _Subscription(converter, forms)
        shared.subscriber = rospy.Subscriber(
            topic,
            converter.message_class,
            self._received,
            (topic, shared),
            queue_size=BURST,
            tcp_nodelay=True,
        )
        self._subscriptions[topic] = shared

    def change_form(self, owner: int, topic: str, form: Form) -> None:
        """Deliver a topic to a client in another form from now on."""
        shared = self._subscriptions[topic]
        with shared.lock:
            shared.forms[owner] = form

    def unsubscribe(self, owner: int, topic: str) -> None:
        """Leave a shared subscriber; the last one closes it."""
        shared = self._subscriptions[topic]
        with shared.lock:
            shared.forms.pop(owner, None)
        if not shared.forms:
            del self._subscriptions[topic]
            self._leaving.leave(shared.subscriber.unregister)

    def _received(self, message: Any, context: tuple[str, _Subscription]) -> None:
        """Encode a message once for each form that is wanted, in rospy's thread."""
        topic, shared = context
        outgoing = Outgoing(message, next(self._numbers), self.now(), self._encoders)
        with shared.lock:
            forms = set(shared.forms.values())
        if not forms:  # nobody wants it: it has not left the graph yet, and another may have come
            return
        try:
            for form in forms:
                outgoing.frames(form)
        except Exception as error:
            self.errors += 1
            rospy.logerr_throttle(
                _LOG_PERIOD, f"gateway: a message of {topic} cannot be converted: {error!r}"
            )
            return
        header = message._connection_header or {}
        with shared.lock:
            if header.get("latching") == "1":
                shared.latched[header.get("callerid", "")] = outgoing
            self.deliver(topic, outgoing, None)

    def now(self) -> tuple[int, int]:
        """Return ROS time."""
        now = rospy.get_rostime()
        return now.secs, now.nsecs

    def _converter(self, topic: str, type_name: str | None, held: str | None = None) -> Converter:
        """Return the converter for a topic; the type must agree with what the graph knows.

        ``held``: the type that counts while the graph knows none.
        """
        known = self.topic_types().get(topic)
        known = held if known in (None, "*") else known
        if type_name is None and known is None:
            raise GraphError(f"the type of {topic} is not known: advertise it, or give `type`")
        if type_name is not None and known is not None and type_name != known:
            raise GraphError(f"{topic} has type {known}, not {type_name}")
        return self._converters.by_name(known or type_name or "")
