"""One client's side of the conversation: what came is judged here, the shell performs it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from msgspec import UNSET

from rosbridge_gateway.config import Limits, Takes
from rosbridge_gateway.protocol import names, packets
from rosbridge_gateway.protocol.audit import Entry, Trail
from rosbridge_gateway.protocol.packets import (
    Packet,
    PacketError,
    PacketId,
    ServiceResponse,
    Status,
)
from rosbridge_gateway.protocol.roles import Roles, without_token
from rosbridge_gateway.wire.fragments import Assembly
from rosbridge_gateway.wire.outgoing import COMPRESSIONS, Form

ReadPng = Callable[[str, int], bytes]

_SEVERITY = {"info": 0, "warning": 1, "error": 2, "none": 3}
_REMARK_INTERVAL = 1.0  # our choice: [s] between two remarks that a client is held back
_REMARK_FROM = 0.25  # our choice: [s] that it has to wait at least
_NAME = 100  # our choice: longest part of a name that the audit shows


@dataclass(frozen=True, slots=True)
class Request:
    """A packet that may be performed, with the absolute name of its topic or service."""

    packet: Packet
    name: str


@dataclass(frozen=True, slots=True)
class Arrived:
    """A packet of a client that could be read, and waits for its turn."""

    packet: Packet


@dataclass(frozen=True, slots=True)
class Wishes:
    """How a client wants a topic: least interval [s], longest queue, and the form of messages."""

    interval: float
    queue_length: int
    form: Form


@dataclass(slots=True)
class Counters:
    """What a client sent."""

    received: int = 0
    refused: int = 0
    held_back: int = 0


class Session:
    """The protocol state of one client.

    ``read`` and ``judge`` (both: ``receive``) return a :class:`Request` to perform, an answer to
    send, or None. What has been performed is told back by ``subscribed``, ``advertised`` and their
    counterparts.
    """

    def __init__(
        self,
        role: str,
        roles: Roles,
        namespace: str,
        limits: Limits,
        takes: Takes,
        now: float,
        read_png: ReadPng,
    ) -> None:
        """Begin.

        Args:
            role: Of the client.
            roles: Who may do what.
            namespace: Where names without a leading slash stand.
            limits: What any client may take.
            takes: What a client of this role may take.
            now: Monotonic [s].
            read_png: Returns the text of a PNG image, at most so many bytes; raises ValueError.
        """
        self.role = role
        # Of this client; the server adds them up when it has gone.
        self.counters = Counters()
        self._roles = roles
        self._namespace = namespace
        self._limits = limits
        self._takes = takes
        self._remark_at = float("-inf")
        self._level = _SEVERITY["error"]
        self._advertised: dict[str, set[PacketId]] = {}
        self._subscribed: dict[str, dict[PacketId, packets.Subscribe]] = {}
        self._services: set[str] = set()
        self._assembly = Assembly(takes.packet_bytes)
        self._read_png = read_png
        self._trail = Trail(now)
        self._entries: list[Entry] = []

    def receive(self, data: bytes, now: float) -> Request | Packet | None:
        """Read and judge one packet that came at ``now`` (monotonic, [s])."""
        found = self.read(data, now)
        return self.judge(found.packet, now) if isinstance(found, Arrived) else found

    def read(self, data: bytes, now: float) -> Arrived | Packet | None:
        """Read one packet; return it, or what it is answered if it is none."""
        self.counters.received += 1
        try:
            packet = packets.decode(data, self._takes.packet_bytes, self._limits.nesting)
        except PacketError as error:
            return self._unreadable(error, now)
        if isinstance(packet, packets.Fragment | packets.Png):
            return self._unwrap(packet, now)
        return Arrived(packet)

    def judge(self, packet: Packet, now: float, stops: bool = False) -> Request | Packet | None:
        """Judge a packet in its turn: what the client sent before has been performed.

        A call that ``stops`` a robot needs no right: it is the service that everybody may ask.
        """
        if isinstance(packet, packets.SetLevel):
            self._level = _SEVERITY[packet.level]
            return None
        if isinstance(packet, Status):
            return None
        try:
            name = names.resolve(_written(packet), self._namespace)
        except names.NameNotLegalError as error:
            return self.refuse(packet, str(error), now)
        anybodys = stops and isinstance(packet, packets.CallService)
        reason = None if anybodys else self._roles.authorise(self.role, _op(packet), name)
        reason = reason or self._exceeded(packet, name)
        return self.refuse(packet, reason, now) if reason else Request(packet, name)

    def _unwrap(self, outer: packets.Fragment | packets.Png, now: float) -> Arrived | Packet | None:
        """Read the packet inside an image, or inside fragments as soon as all are there."""
        limit = self._takes.packet_bytes
        try:
            if isinstance(outer, packets.Png):
                inner = self._read_png(outer.data, limit)
            else:
                whole = self._assembly.add(outer, now)
                if whole is None:
                    return None
                inner = whole
        except ValueError as error:
            self.counters.refused += 1
            return self.status("error", str(error), outer.id)
        try:
            packet = packets.decode(inner, limit, self._limits.nesting)
        except PacketError as error:
            return self._unreadable(error, now)
        if isinstance(packet, packets.Png) and isinstance(outer, packets.Fragment):
            return self._unwrap(packet, now)
        if isinstance(packet, packets.Fragment | packets.Png):
            self.counters.refused += 1
            return self.status("error", f"{_op(packet)} inside {_op(outer)}", packet.id)
        return Arrived(packet)

    def _unreadable(self, error: PacketError, now: float) -> Packet | None:
        """Answer what is no packet.

        A call is answered as a call, whatever is wrong with it, because its sender waits.
        """
        if error.call is not None:
            return self.refuse(error.call, str(error), now)
        self.counters.refused += 1
        return self.status("error", str(error), error.packet_id)

    def held_back(self, wait: float, now: float) -> Status | None:
        """Count that the client has to wait, and return a remark on it, one a second at most.

        Args:
            wait: How long [s] nothing of it is read.
            now: Monotonic [s].
        """
        self.counters.held_back += 1
        if wait < _REMARK_FROM or now - self._remark_at < _REMARK_INTERVAL:
            return None
        self._remark_at = now
        return self.status(
            "error",
            f"your packets are read {wait:.1f} s later: this connection took more packets, bytes "
            f"or processor time a second than a {self.role} may; send less, or raise roles."
            f"{self.role}.takes in gateway.yaml",
            UNSET,
        )

    def is_exempt(self, right: str, name: str) -> bool:
        """Return whether ``name`` may be used beside other nodes; see :class:`Roles`."""
        return self._roles.is_exempt(self.role, right, name)

    def _exceeded(self, packet: Packet, name: str) -> str | None:
        """Tell which limit a packet breaks, or None."""
        limits = self._limits
        match packet:
            case packets.Subscribe():
                return _full(self._subscribed, name, limits.topics_per_client, "subscribed topics")
            case packets.Advertise():
                return _full(self._advertised, name, limits.topics_per_client, "advertised topics")
            case packets.AdvertiseService():
                return _full(
                    self._services, name, limits.services_per_client, "advertised services"
                )
            case packets.Unsubscribe() if name not in self._subscribed:
                return f"{name} is not subscribed"
            case packets.Unadvertise() if name not in self._advertised:
                return f"{name} is not advertised"
            case packets.UnadvertiseService() if name not in self._services:
                return f"{name} is not advertised as a service"
        return None

    def refuse(self, packet: Packet, reason: str, now: float) -> Packet | None:
        """Count and note a refusal and return its answer.

        That is a failed response to a call, else a status of level error.
        """
        self.counters.refused += 1
        self._note(packet, _written(packet), False, reason, now)
        if isinstance(packet, packets.CallService):
            return ServiceResponse(
                id=packet.id, service=packet.service, values=reason, result=False
            )
        return self.status("error", reason, packet.id)

    def status(self, level: packets.Level, text: str, packet_id: PacketId) -> Status | None:
        """Return a remark on a packet, or None if the client does not want its level."""
        return (
            Status(id=packet_id, level=level, msg=text) if _SEVERITY[level] >= self._level else None
        )

    def performed(self, request: Request, outcome: Any, now: float) -> None:
        """Note what a client has published, called or offered.

        What it only hears is nobody's concern.
        """
        if isinstance(
            request.packet, packets.Publish | packets.CallService | packets.AdvertiseService
        ):
            self._note(request.packet, request.name, True, outcome, now)

    def _note(self, packet: Packet, name: str, success: bool, outcome: Any, now: float) -> None:
        details = (
            packet.msg if isinstance(packet, packets.Publish) else getattr(packet, "args", None)
        )
        what = f"{_op(packet)} {name[:_NAME]}"
        entry = self._trail.note(what, without_token(details), success, outcome, now)
        if entry is not None:
            self._entries.append(entry)

    def take_entries(self) -> list[Entry]:
        """Return what the audit is to be told, once."""
        entries, self._entries = self._entries, []
        return entries

    def subscribed(self, name: str, packet: packets.Subscribe) -> None:
        """Note a subscription; another with the same id takes its place."""
        self._subscribed.setdefault(name, {})[packet.id] = packet

    def remark(self, packet: packets.Subscribe) -> Status | None:
        """Return a warning about a subscription that gets less than it asks for, or None."""
        if packet.compression in (None, "", *COMPRESSIONS):
            return None
        allowed = ", ".join(COMPRESSIONS)
        text = f"compression {packet.compression!r} is not known, JSON is sent: allowed: {allowed}"
        return self.status("warning", text, packet.id)

    def wishes(self, name: str, more: packets.Subscribe | None = None) -> Wishes:
        """Return what the client's ids together ask for ``name``, ``more`` included."""
        by_id = dict(self._subscribed.get(name, {}))
        if more is not None:
            by_id[more.id] = more
        wishes = list(by_id.values())
        sizes = [w.fragment_size for w in wishes if w.fragment_size is not None]
        return Wishes(
            min(w.throttle_rate for w in wishes) / 1000.0,
            max(w.queue_length for w in wishes),
            Form(
                wishes[-1].topic,
                max(map(_compression, wishes), key=COMPRESSIONS.index),
                self.fragment_size(min(sizes, default=None)),
            ),
        )

    def fragment_size(self, wanted: int | None) -> int | None:
        """Return how long the pieces are that the client gets, None for any length."""
        return None if wanted is None else max(wanted, self._takes.shortest_fragment)

    def unsubscribed(self, name: str, packet_id: PacketId) -> bool:
        """Note the end of one subscription (of all without an id).

        Return whether the topic is no longer wanted.
        """
        wishes = self._subscribed.get(name, {})
        if packet_id in (UNSET, None):
            wishes.clear()
        wishes.pop(packet_id, None)
        return not wishes and self._subscribed.pop(name, None) is not None

    def advertised(self, name: str, packet_id: PacketId) -> None:
        """Note an advertised topic."""
        self._advertised.setdefault(name, set()).add(packet_id)

    def unadvertised(self, name: str, packet_id: PacketId) -> bool:
        """Note the end of one advertisement (of all without an id); True when none is left."""
        ids = self._advertised.get(name, set())
        if packet_id in (UNSET, None):
            ids.clear()
        ids.discard(packet_id)
        return not ids and self._advertised.pop(name, None) is not None

    def needs_no_turn(self, packet: Packet) -> bool:
        """Tell whether a packet is performed at once when it is judged, and waits for nothing."""
        if not isinstance(packet, packets.Publish):
            return isinstance(packet, packets.SetLevel | Status)
        try:
            return names.resolve(packet.topic, self._namespace) in self._advertised
        except names.NameNotLegalError:
            return True

    def is_advertised(self, name: str) -> bool:
        """Tell whether the client publishes topic ``name``."""
        return name in self._advertised

    def provides(self, name: str, added: bool) -> None:
        """Note that the client answers calls of service ``name``, or no more."""
        (self._services.add if added else self._services.discard)(name)

    @property
    def subscriptions(self) -> tuple[str, ...]:
        """Subscribed topics."""
        return tuple(self._subscribed)

    @property
    def advertisements(self) -> tuple[str, ...]:
        """Advertised topics."""
        return tuple(self._advertised)

    @property
    def services(self) -> tuple[str, ...]:
        """Services that the client answers."""
        return tuple(self._services)


def _compression(packet: packets.Subscribe) -> str:
    return packet.compression if packet.compression in COMPRESSIONS else COMPRESSIONS[0]


def _op(packet: Packet) -> str:
    return str(type(packet).__struct_config__.tag)


def _written(packet: Packet) -> str:
    """Return the topic or service of a packet as the client wrote it."""
    return str(getattr(packet, "topic", None) or getattr(packet, "service", ""))


def _full(taken: Iterable[str], name: str, limit: int, what: str) -> str | None:
    """Tell that ``limit`` is reached, unless ``name`` is among ``taken`` already."""
    known = set(taken)
    return (
        f"{len(known)} {what}: allowed: {limit}"
        if name not in known and len(known) >= limit
        else None
    )
