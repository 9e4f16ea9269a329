"""Text as a PNG image, as rosbridge compresses it: bytes are pixels, padded with line ends."""

from __future__ import annotations

import base64
import io
import math
import struct

from PIL import Image

_CHANNELS = 3
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHUNK = struct.Struct(">I4s")
_CHECK_BYTES = 4  # behind each chunk's data
_PICTURE = (b"IHDR", b"IDAT", b"IEND")


class PngError(ValueError):
    """What came is no such image; the text says why."""


def pack(text: bytes) -> str:
    """Return UTF-8 text as base64 of a PNG image, about as wide as high."""
    width = max(1, math.isqrt(len(text) // _CHANNELS))
    height = max(1, math.ceil(len(text) / (_CHANNELS * width)))
    image = Image.frombytes("RGB", (width, height), text.ljust(width * height * _CHANNELS, b"\n"))
    buffer = io.BytesIO()
    image.save(buffer, "png")
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def unpack(data: str, max_bytes: int) -> bytes:
    """Return the text of an image.

    Args:
        data: Base64 of a PNG image.
        max_bytes: Longest text; a larger image is not even decoded.

    Raises:
        PngError: It is no PNG image, too large, or holds more than its picture: texts and profiles
            are packed for themselves, and may unpack to any size.
    """
    try:
        octets = base64.b64decode(data, validate=True)
        _check_chunks(octets)
        with Image.open(io.BytesIO(octets), formats=["PNG"]) as image:
            size = image.width * image.height * _CHANNELS
            if size > max_bytes:
                raise PngError(f"an image of {size} bytes: allowed: {max_bytes}")
            return image.convert("RGB").tobytes()
    except PngError:
        raise
    except (ValueError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise PngError(f"data is no PNG image in base64: {error}") from error


def _check_chunks(octets: bytes) -> None:
    """Refuse an image with other chunks than those of its picture, before any is unpacked."""
    if not octets.startswith(_SIGNATURE):
        raise ValueError("it does not begin like one")
    start, name = len(_SIGNATURE), b""
    while name != _PICTURE[-1]:
        if len(octets) - start < _CHUNK.size:
            raise ValueError("it is cut off")
        size, name = _CHUNK.unpack_from(octets, start)
        if name not in _PICTURE:
            shown = name.decode("latin-1")
            raise PngError(
                f"an image with a chunk {shown!r}: allowed: its picture alone (IHDR, IDAT, IEND)"
            )
        start += _CHUNK.size + size + _CHECK_BYTES
    if start != len(octets):
        raise PngError(f"an image with {len(octets) - start} bytes behind its end: allowed: none")
