"""The camera is heard in a thread that may wait for the master: no page waits for it."""

from __future__ import annotations

import asyncio
import threading

import pytest
import rospy
from operator_panel.link import camera_link_node
from operator_panel.link.camera_link_node import CameraLink
from sensor_msgs.msg import Image

DEADLINE_S = 10.0


def picture_of(second: int) -> Image:
    """Return a picture of one pixel."""
    image = Image(encoding="rgb8", width=1, height=1, step=3, data=bytes(3))
    image.header.stamp = rospy.Time(second)
    return image


def test_no_page_waits_for_a_master_that_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    """STOP of all pages is heard in their loop, while a subscription begins and while it ends."""
    hung, back = threading.Event(), threading.Event()

    class Subscription:
        def __init__(self, *_: object, **__: object) -> None:
            self.unregister()

        def unregister(self) -> None:
            hung.set()
            assert back.wait(DEADLINE_S)

    async def scene() -> list[str]:
        link, loop, stamps = CameraLink(), asyncio.get_running_loop(), [""]
        for second, wanted_for in enumerate((DEADLINE_S, 0.0), start=1):
            asked = asyncio.create_task(link.picture(stamps[-1]))
            await asyncio.sleep(0)
            monkeypatch.setattr(camera_link_node, "LINGER_S", wanted_for)
            looking = loop.run_in_executor(None, link.look)
            assert await loop.run_in_executor(None, hung.wait, DEADLINE_S)
            monkeypatch.setattr(camera_link_node, "LINGER_S", DEADLINE_S)
            link._take(picture_of(second))
            found = await asked
            assert found is not None
            stamps.append(found[0])
            back.set()
            await looking
            hung.clear()
            back.clear()
        return stamps

    monkeypatch.setattr(rospy, "Subscriber", Subscription)
    monkeypatch.setattr(camera_link_node, "WAIT_S", DEADLINE_S)
    assert asyncio.run(scene()) == ["", "1.000000000", "2.000000000"]


def test_picture_that_comes_when_nobody_looks_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be shown as new to the next who does."""
    link = CameraLink()
    link._take(picture_of(1))
    monkeypatch.setattr(camera_link_node, "WAIT_S", 0.01)
    assert asyncio.run(link.picture("")) is None
