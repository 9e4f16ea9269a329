"""Frames are made for pages: while none is open only the charts go on."""

from __future__ import annotations

import asyncio
import math
import time
from types import SimpleNamespace
from typing import Any, cast

import pytest
from harness.workspace import ROOT
from operator_panel.config import load_panel
from operator_panel.view.frame import Frame, FrameMaker, Points
from operator_panel.view.live_io import Live
from operator_panel.view.progress import CommandLog
from operator_panel.view.snapshot import Snapshot
from scara_config import load_robot
from starlette.websockets import WebSocketDisconnect

CONFIG = load_panel(ROOT / "config")
POINT: Points = {name.name: (1.0, 1.0, None, None, None, None) for name in load_robot().twin_joints}


class Maker:
    """Counts what it is asked to make."""

    def __init__(self) -> None:
        self.frames = 0

    def make(self, snapshot: Snapshot, now: float) -> Frame:
        """Count a frame."""
        self.frames += 1
        return Frame(now, {}, {}, point=POINT)

    def points(self, snapshot: Snapshot, now: float) -> Points:
        """Return points, which are no frame."""
        return POINT


class Door:
    """A cell that remembers whether it is watched."""

    def __init__(self) -> None:
        self.watched: list[bool] = []

    def snapshot(self) -> Snapshot:
        """Return one that is never silent."""
        return Snapshot(master=True, received=math.inf)

    def watch(self, watched: bool) -> None:
        """Remember."""
        self.watched.append(watched)


class Desk:
    """Knows the pages a and b."""

    sessions = ("a", "b")

    def __init__(self) -> None:
        self.log = CommandLog()

    def tick(self) -> None:
        """Do nothing."""

    def arrived(self, page: str, tab: str) -> None:
        """Do nothing."""

    def left(self, page: str) -> None:
        """Do nothing."""


class Socket:
    """A page's connection: it takes frames until it is closed."""

    def __init__(self, page: str) -> None:
        self.query_params = {"page": page}
        self.sent: list[str] = []
        self.closed = asyncio.Event()

    async def accept(self) -> None:
        """Do nothing."""

    async def send_text(self, text: str) -> None:
        """Remember."""
        self.sent.append(text)

    async def receive_json(self) -> Any:
        """Say nothing until the page is closed."""
        await self.closed.wait()
        raise WebSocketDisconnect


@pytest.fixture
def parts() -> SimpleNamespace:
    """Return a live connection and what is around it."""
    found = SimpleNamespace(maker=Maker(), door=Door())
    maker = cast(FrameMaker, found.maker)
    found.live = Live(cast(Any, found.door), cast(Any, Desk()), maker, CONFIG)
    return found


async def until(condition: Any) -> None:
    """Let the others run until ``condition`` holds."""

    async def wait() -> None:
        while not condition():
            await asyncio.sleep(0.001)

    await asyncio.wait_for(wait(), 10.0)


def test_without_a_page_a_frame_is_made_when_somebody_looks_back(parts: SimpleNamespace) -> None:
    """A page that opens later gets the points of that time, and can look back to it."""

    async def scene() -> None:
        running = asyncio.create_task(parts.live.run())
        await until(lambda: len(parts.live._history.rows) >= 2)
        running.cancel()

    asyncio.run(scene())
    assert parts.maker.frames == 0 and parts.door.watched == []
    look = parts.live.past.look(time.time(), 20.0)
    assert look is not None and parts.maker.frames == 1
    assert look.rows[-1][0] == look.frame.t and "today.cycles" in look.frame.text


def test_the_first_page_wakes_the_frames_and_the_last_ends_them(parts: SimpleNamespace) -> None:
    """It gets them at once; the cell is told when somebody looks and when nobody does."""

    async def scene() -> None:
        running = asyncio.create_task(parts.live.run())
        await asyncio.sleep(0)
        pages = [Socket("a"), Socket("b")]
        serving = [asyncio.create_task(parts.live._serve(cast(Any, page))) for page in pages]
        await until(lambda: all('{"frame":' in "".join(page.sent) for page in pages))
        pages[0].closed.set()
        await serving[0]
        assert parts.door.watched[-1]
        pages[1].closed.set()
        await serving[1]
        assert not parts.door.watched[-1]
        made = parts.maker.frames
        rows = len(parts.live._history.rows)
        await until(lambda: len(parts.live._history.rows) >= rows + 1)
        assert parts.maker.frames <= made + 1  # one step may have been waiting for its time
        running.cancel()

    asyncio.run(scene())
