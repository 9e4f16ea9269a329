"""One message of a topic, in each form that somebody asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import msgspec

from rosbridge_gateway.protocol.packets import encode_publish
from rosbridge_gateway.wire import cbor
from rosbridge_gateway.wire.fragments import split

COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
"""What a subscription may ask for; of several the last one counts, as with rosbridge_server."""


@dataclass(frozen=True, slots=True)
class Form:
    """How one client wants a topic.

    ``topic`` is its name as the client wrote it; ``fragment_size`` the most characters of a packet
    (JSON or PNG) that may go out in one piece.
    """

    topic: str
    compression: str = "none"
    fragment_size: int | None = None


@dataclass(frozen=True, slots=True)
class Frames:
    """What goes out for one packet: web-socket frames, of text or of bytes."""

    parts: tuple[bytes, ...]
    is_text: bool = True


class Encoders(Protocol):
    """The encodings of a message."""

    def json(self, message: Any) -> bytes:
        """Return JSON text."""

    def cbor(self, message: Any) -> bytes:
        """Return a CBOR map."""

    def raw(self, message: Any) -> bytes:
        """Return the message in ROS's own form."""

    def png(self, text: bytes) -> str:
        """Return a text as base64 of an image."""


_FORMS = 8  # our choice: in so many forms a message is kept


class Outgoing:
    """A message that is encoded once for each form, whoever asks first."""

    def __init__(
        self, message: Any, number: int, received: tuple[int, int], encoders: Encoders
    ) -> None:
        """Take a message.

        Args:
            message: The message.
            number: Of all messages; names its fragments.
            received: ROS time of its receipt: seconds, nanoseconds.
            encoders: What can write it.
        """
        self._message, self._number, self._received = message, number, received
        self._encoders = encoders
        self._bodies: dict[str, bytes] = {}
        self._frames: dict[Form, Frames] = {}

    def frames(self, form: Form) -> Frames:
        """Return the packet in a form; callable from any thread."""
        known = self._frames.get(form)
        if known is not None:
            return known
        if form.compression in ("cbor", "cbor-raw"):
            packet = cbor.publish_packet(form.topic, self._body(form.compression))
            made = Frames((packet,), False)
        else:
            packet = encode_publish(form.topic, self._body("none"))
            if form.compression == "png":
                packet = msgspec.json.encode({"op": "png", "data": self._encoders.png(packet)})
            made = Frames(split(packet, form.fragment_size, f"publish:{self._number}"))
        if len(self._frames) >= _FORMS:
            # Of a latched message: clients come and go, each with other wishes.
            self._frames.clear()
        self._frames[form] = made
        return made

    def _body(self, kind: str) -> bytes:
        """Return the message alone, without its packet."""
        made = self._bodies.get(kind)
        if made is None:
            if kind == "cbor":
                made = self._encoders.cbor(self._message)
            elif kind == "cbor-raw":
                made = cbor.raw_message(*self._received, self._encoders.raw(self._message))
            else:
                made = self._encoders.json(self._message)
            self._bodies[kind] = made
        return made
