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
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import PageDesk
from operator_panel.control.jog import DeadMan
from operator_panel.door import Answer
from operator_panel.page.view_io import PageView
from operator_panel.view import live_io
from operator_panel.view.frame import Frame, FrameMaker, Points
from operator_panel.view.live_io import Live
from operator_panel.view.progress import KEPT, CommandLog
from operator_panel.view.snapshot import Snapshot
from scara_config import load_robot
from starlette.websockets import WebSocketDisconnect
from unit.operator_panel.control.conftest import KEEP_S, LET_GO_S, ROBOT, SCARA

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
        self.there: list[str] = []

    def tick(self) -> None:
        """Do nothing."""

    def arrived(self, page: str, tab: str) -> None:
        """Remember."""
        self.there.append(page)

    def left(self, page: str) -> None:
        """Remember."""
        self.there.remove(page)


class Socket:
    """A page's connection: it takes frames until it is closed."""

    def __init__(self, page: str) -> None:
        self.query_params = {"page": page}
        self.sent: list[str] = []
        self.closed = asyncio.Event()
        self.said: asyncio.Queue[Any] = asyncio.Queue()

    async def accept(self) -> None:
        """Do nothing."""

    async def send_text(self, text: str) -> None:
        """Remember."""
        self.sent.append(text)

    async def receive_json(self) -> Any:
        """Say what a test says, until the page is closed."""
        said, closed = (asyncio.ensure_future(one) for one in (self.said.get(), self.closed.wait()))
        await asyncio.wait({said, closed}, return_when=asyncio.FIRST_COMPLETED)
        if said.done():
            return said.result()
        said.cancel()
        raise WebSocketDisconnect


@pytest.fixture
def parts() -> SimpleNamespace:
    """Return a live connection and what is around it."""
    found = SimpleNamespace(maker=Maker(), door=Door(), desk=Desk())
    maker = cast(FrameMaker, found.maker)
    found.live = Live(cast(Any, found.door), cast(Any, found.desk), maker, CONFIG)
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


def test_a_page_from_which_nothing_comes_is_not_there_until_it_speaks_again(
    parts: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when a network is gone without a word: it keeps no control, and its STOP still counts.

    The time is the test's own.
    """
    clock = SimpleNamespace(now=time.monotonic())
    time_ = SimpleNamespace(monotonic=lambda: clock.now, time=time.time)
    monkeypatch.setattr(live_io, "time", time_)
    create = "operator_panel.view.live_io.background_tasks.create"
    monkeypatch.setattr(create, asyncio.create_task)
    stopped: list[str] = []

    async def stop(page: str, command: str) -> Answer:
        stopped.append(command)
        return Answer(True, "both are stopped", {"confirmed": True})

    async def scene() -> None:
        running = asyncio.create_task(parts.live.run())
        page = Socket("a")
        serving = asyncio.create_task(parts.live._serve(cast(Any, page)))
        await until(lambda: parts.desk.there == ["a"])
        clock.now += 1.1 * live_io.AWAY_S
        await until(lambda: parts.desk.there == [])
        page.said.put_nowait({"stop": "STOP", "press": 1})
        await until(lambda: parts.desk.there == ["a"] and stopped == ["STOP"])
        line = parts.live._lines["a"]
        for _ in range(4):
            clock.now += 0.9 * live_io.AWAY_S
            page.said.put_nowait({"alive": 1})
            await until(lambda: line.heard == clock.now)
            made = parts.maker.frames
            await until(lambda made=made: parts.maker.frames > made)  # one look more
            assert parts.desk.there == ["a"]
        page.closed.set()
        await serving
        assert parts.desk.there == []
        running.cancel()

    parts.desk.stop = stop
    asyncio.run(scene())


def test_who_only_watches_fills_no_list_that_all_pages_share(parts: SimpleNamespace) -> None:
    """Else a motion that an operator's run follows is forgotten, and so is what happened before."""
    dead_man, door = DeadMan(ROBOT, 10.0, 0.25), parts.door
    desk = PageDesk(door, dead_man, SCARA, KEEP_S, LET_GO_S, 0.6, lambda _: None)
    live, line = Live(door, desk, parts.maker, CONFIG), live_io._Line(cast(Any, Socket("v")))
    nothing: Any = None
    view = PageView(nothing, nothing, nothing, door, desk, desk.open("v", Role.VIEWER))
    running = desk.begin("a", "MOVE_JOINTS", "Line 1")

    async def scene() -> None:
        for press in range(KEPT + 10):
            sign = {"hold": press, "joint": "joint_1", "direction": 1, "percent": 3}
            await live._hear("v", sign, line)
            view.tell(Answer(False, "x, y and z are needed"), "Move")

    asyncio.run(scene())
    assert "only watches" in line.waiting["refused"]
    assert desk.log.find(running) is not None and desk.log.take_ended() == []
