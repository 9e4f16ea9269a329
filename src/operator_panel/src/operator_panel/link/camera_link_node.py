"""The camera's pictures, heard only while a page asks for them.

So the camera draws no pictures that nobody sees.
"""

from __future__ import annotations

import asyncio
import io
import threading
import time
from typing import Any

import PIL.Image
import rospy
from nicegui import run
from sensor_msgs.msg import Image

QUALITY = 85  # our choice: about 20 kB for a picture of the shipped size
WAIT_S = 2.0  # our choice: a page that waits longer is told that no picture comes
LINGER_S = 5.0  # our choice: so long after the last question the camera is left alone again
LOOK_S = 0.02


class CameraLink:
    """Subscribes to ``camera/image_raw`` while pages look."""

    def __init__(self) -> None:
        """Listen to nothing yet."""
        self._lock = threading.Lock()
        self._subscriber: Any = None
        self._newest: Image | None = None
        self._encoding = asyncio.Lock()
        self._encoded = "", b""
        self._asked = 0.0

    async def picture(self, after: str) -> tuple[str, bytes] | None:
        """Return the next picture that is not that of ``after``; None if none comes in time."""
        end = time.monotonic() + WAIT_S
        while (now := time.monotonic()) < end:
            with self._lock:
                self._asked = now
                if self._subscriber is None and rospy.core.is_initialized():
                    self._subscriber = rospy.Subscriber(
                        "camera/image_raw", Image, self._take, queue_size=1, tcp_nodelay=True
                    )
            newest = self._newest
            at = newest.header.stamp if newest is not None else None
            if at is not None and (stamp := f"{at.secs}.{at.nsecs:09d}") != after:
                async with self._encoding:  # each picture is packed once for all pages
                    if self._encoded[0] != stamp:
                        packed = await run.io_bound(_pack, newest) or b""
                        self._encoded = stamp, packed
                    return self._encoded
            await asyncio.sleep(LOOK_S)
        return None

    def look(self) -> None:
        """Leave the camera alone when nobody has asked for a while.

        Any thread may call this; it has to be called now and then.
        """
        with self._lock:
            if self._subscriber is not None and time.monotonic() - self._asked > LINGER_S:
                self._subscriber.unregister()
                self._subscriber, self._newest = None, None

    def _take(self, message: Image) -> None:
        # Anything else would have wrong colours, or fail where it is packed for a page.
        if message.encoding == "rgb8" and len(message.data) == message.step * message.height:
            self._newest = message


def _pack(image: Image) -> bytes:
    size = (image.width, image.height)
    packed = io.BytesIO()
    PIL.Image.frombuffer("RGB", size, image.data, "raw", "RGB", image.step, 1).save(
        packed, "JPEG", quality=QUALITY
    )
    return packed.getvalue()
