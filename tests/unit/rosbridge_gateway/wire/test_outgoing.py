"""A message goes out in each form that somebody asked for, encoded once."""

from __future__ import annotations

import base64
import io
import json
from typing import Any

import cbor2
import pytest
from PIL import Image
from rosbridge_gateway.wire.outgoing import Form, Outgoing
from rosbridge_gateway.wire.png_io import PngError, pack, unpack


class Encoders:
    """Writes a text in all forms, and counts."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def json(self, message: Any) -> bytes:
        """Return JSON text."""
        self.calls.append("json")
        return json.dumps(message, ensure_ascii=False).encode()

    def cbor(self, message: Any) -> bytes:
        """Return CBOR."""
        self.calls.append("cbor")
        return cbor2.dumps(message)

    def raw(self, message: Any) -> bytes:
        """Return ROS's own form."""
        self.calls.append("raw")
        return b"raw"

    def png(self, text: bytes) -> str:
        """Return an image."""
        self.calls.append("png")
        return pack(text)


MESSAGE = {"data": "\u00e4" * 100}
PACKET = {"op": "publish", "topic": "t", "msg": MESSAGE}


def outgoing(encoders: Encoders) -> Outgoing:
    """Return a message."""
    return Outgoing(MESSAGE, 7, (12, 34), encoders)


def test_json_and_cbor_packets_are_the_same() -> None:
    """Text frames and binary frames."""
    message = outgoing(Encoders())
    text = message.frames(Form("t"))
    assert text.is_text and [json.loads(part) for part in text.parts] == [PACKET]
    binary = message.frames(Form("t", "cbor"))
    assert not binary.is_text and [cbor2.loads(part) for part in binary.parts] == [PACKET]


def test_raw_packet_holds_the_message_and_its_time() -> None:
    """As a viewer decodes it by the definition of its type."""
    (part,) = outgoing(Encoders()).frames(Form("t", "cbor-raw")).parts
    assert cbor2.loads(part)["msg"] == {"secs": 12, "nsecs": 34, "bytes": b"raw"}


def test_image_holds_the_packet_in_its_pixels() -> None:
    """A client reads the pixels of any PNG reader as text."""
    frames = outgoing(Encoders()).frames(Form("t", "png"))
    outer = json.loads(frames.parts[0])
    assert frames.is_text and outer.keys() == {"op", "data"} and outer["op"] == "png"
    image = Image.open(io.BytesIO(base64.b64decode(outer["data"])))
    assert image.format == "PNG" and image.mode == "RGB"
    assert json.loads(image.tobytes()) == PACKET


def test_long_text_goes_out_in_pieces_and_cbor_never() -> None:
    """A fragment is text."""
    message = outgoing(Encoders())
    for compression in ("none", "png"):
        parts = [json.loads(p) for p in message.frames(Form("t", compression, 64)).parts]
        assert {part["id"] for part in parts} == {"publish:7"} and len(parts) > 1
        whole = json.loads("".join(part["data"] for part in parts))
        assert whole["op"] == ("png" if compression == "png" else "publish")
    assert len(message.frames(Form("t", "cbor", 64)).parts) == 1


def test_a_message_that_is_kept_does_not_grow_with_the_wishes_of_clients() -> None:
    """A latched one stays, and clients with other lengths of pieces come and go."""
    message = outgoing(Encoders())
    assert all(message.frames(Form("t", "none", size)).parts for size in range(1000, 1100))
    assert len(message._frames) <= 8


def test_each_encoding_is_made_once_for_all_clients() -> None:
    """Names and sizes differ, the message does not."""
    encoders = Encoders()
    message = outgoing(encoders)
    for topic in ("t", "/t", "t"):
        for compression in ("none", "cbor", "cbor-raw"):
            message.frames(Form(topic, compression, 64))
            message.frames(Form(topic, compression))
    assert sorted(encoders.calls) == ["cbor", "json", "raw"]


@pytest.mark.parametrize("size", [1, 2, 3, 4, 10, 299, 10_000])
def test_text_of_any_length_fits_an_image(size: int) -> None:
    """Padded with line ends, which JSON ignores."""
    text = b'"' + b"x" * size + b'"'
    assert unpack(pack(text), 20_000).rstrip(b"\n") == text


def test_image_that_is_too_large_is_not_decoded() -> None:
    """A small file may hold a huge image."""
    with pytest.raises(PngError, match=r"an image of 3000\d+ bytes: allowed: 1000"):
        unpack(pack(b"\n" * 30_000_000), 1000)


def test_what_was_made_for_one_client_is_there_for_the_next() -> None:
    """Also behind that of others."""
    message = outgoing(Encoders())
    made = [message.frames(Form("t", "none", size)) for size in range(1000, 1008)]
    again = [message.frames(Form("t", "none", size)) for size in range(1000, 1008)]
    assert all(one is other for one, other in zip(made, again))
