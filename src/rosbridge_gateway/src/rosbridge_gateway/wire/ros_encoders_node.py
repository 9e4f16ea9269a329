"""The encodings of ROS messages."""

from __future__ import annotations

import io
from typing import Any

import msgspec
import roslib.message

from rosbridge_gateway.protocol.conversion import Converters
from rosbridge_gateway.wire.cbor import CborEncoder
from rosbridge_gateway.wire.png_io import pack


class RosEncoders:
    """Implements :class:`rosbridge_gateway.wire.outgoing.Encoders`."""

    def __init__(self, converters: Converters) -> None:
        self._converters = converters
        self._cbor = CborEncoder(roslib.message.get_message_class)

    def json(self, message: Any) -> bytes:
        """Return JSON text."""
        return msgspec.json.encode(self._converters.by_class(type(message)).to_values(message))

    def cbor(self, message: Any) -> bytes:
        """Return a CBOR map."""
        return self._cbor.encode(message)

    def raw(self, message: Any) -> bytes:
        """Return the message in ROS's own form: what was received, byte by byte."""
        buffer = io.BytesIO()
        message.serialize(buffer)
        return buffer.getvalue()

    def png(self, text: bytes) -> str:
        """Return a text as base64 of an image."""
        return pack(text)
