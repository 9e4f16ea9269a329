"""The camera's pictures, heard only while a page asks for them.

So the camera draws no pictures that nobody sees.
"""

from __future__ import annotations

import asyncio
import io
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
        self._subscriber: Any = None  # only ``look`` touches it
        self._newest: Image | None = None
        self._encoding = asyncio.Lock()
        self._encoded = "", b""
        self._asked = float("-inf")

    async def picture(self, after: str) -> tuple[str, bytes] | None:
        """Return the next picture that is not that of ``after``; None if none comes in time."""
        end = time.monotonic() + WAIT_S
        while (now := time.monotonic()) < end:
            self._asked = now
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
        """Listen to the camera once somebody asks, and leave it alone when nobody has for a while.

        One thread of a ROS node has to call this now and then. It may wait for the master, which
        rospy asks without a time-out; the pages' event loop, which hears STOP, never does.
        """
        wanted = self._is_wanted()
        if wanted and self._subscriber is None:
            self._subscriber = rospy.Subscriber(
                "camera/image_raw", Image, self._take, queue_size=1, tcp_nodelay=True
            )
        elif not wanted and self._subscriber is not None:
            subscriber, self._subscriber, self._newest = self._subscriber, None, None
            subscriber.unregister()

    def _is_wanted(self) -> bool:
        return time.monotonic() - self._asked < LINGER_S

    def _take(self, message: Image) -> None:
        # A picture that comes when nobody looks would be shown as new to the next who does.
        if not self._is_wanted():
            return
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
