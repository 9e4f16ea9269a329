"""Text as a PNG image, as rosbridge compresses it: bytes are pixels, padded with line ends."""

from __future__ import annotations

import base64
import io
import math

from PIL import Image

_CHANNELS = 3


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
        PngError: It is no PNG image, or too large.
    """
    try:
        octets = base64.b64decode(data, validate=True)
        with Image.open(io.BytesIO(octets), formats=["PNG"]) as image:
            size = image.width * image.height * _CHANNELS
            if size > max_bytes:
                raise PngError(f"an image of {size} bytes: allowed: {max_bytes}")
            return image.convert("RGB").tobytes()
    except PngError:
        raise
    except (ValueError, OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise PngError(f"data is no PNG image in base64: {error}") from error
