"""The live connection of each open page: frames out, held buttons in.

When it is lost, the page turns grey and what it holds is released.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import time
from collections.abc import Callable
from datetime import datetime
from functools import partial
from typing import Any

import msgspec
from nicegui import app, background_tasks
from starlette.websockets import WebSocket, WebSocketDisconnect

from operator_panel.config import PanelConfig
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import PageDesk
from operator_panel.control.stop_line_io import ANSWER_S, not_confirmed
from operator_panel.door import Answer, CellDoor
from operator_panel.view.alarms import Alarm, active_alarms
from operator_panel.view.events import EventLog
from operator_panel.view.frame import Frame, FrameMaker
from operator_panel.view.past import History, Past, PastMoment
from operator_panel.view.snapshot import Part, Snapshot
from operator_panel.view.today import Today

LOG = logging.getLogger(__name__)
PATH = "/live"
UNKNOWN_PAGE = 4404
AWAY_S = 4.0
"""Whoever says nothing for so long is not there, though no end of its line was told; our choice: a
page says something each second (web/live.js), and two lost packets take 3 s."""
UNWATCHED_S = 0.5  # our choice: so often chart points are kept while no page is open
_ENCODE = msgspec.json.Encoder().encode


class _Line:
    """What is still to be sent to one page.

    It keeps only the newest of each kind, so that a slow page is late by one frame.
    """

    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket
        self.waiting: dict[str, str] = {}
        self.filled = asyncio.Event()
        self.heard = time.monotonic()
        # It has said nothing for long. It stays open: a STOP that comes over it after all counts.
        self.is_away = False

    def put(self, kind: str, text: str) -> None:
        self.waiting[kind] = text
        self.filled.set()

    async def take(self) -> list[str]:
        await self.filled.wait()
        self.filled.clear()
        texts, self.waiting = list(self.waiting.values()), {}
        return texts


class Live:
    """Sends the same frame to all pages and hears their held buttons."""

    def __init__(
        self, door: CellDoor, desk: PageDesk, maker: FrameMaker, config: PanelConfig
    ) -> None:
        """Offer the web socket; ``run`` sends."""
        self._door, self._desk, self._maker, self._config = door, desk, maker, config
        self._history = History(config.chart_window_s, config.chart_rate_hz)
        self._lines: dict[str, _Line] = {}
        # Set while a page is open: the first one does not wait for the next seldom look.
        self._watched = asyncio.Event()
        # Texts and parts as they were sent last: pages get them again only when they have changed.
        self._lists = ""
        self.events = EventLog()
        self.past = Past()
        self._today = Today()
        self._sent_events = 0
        self._parts: dict[str, tuple[Part, ...]] = {}
        self.listeners: list[Callable[[Snapshot, bool], None]] = []
        app.add_api_websocket_route(PATH, self._serve)

    async def run(self) -> None:
        """Send frames at the update rate, on absolute deadlines, until cancelled.

        While no page is open none is made. The charts go on, and what it takes to make a frame
        is kept for those who look back later.
        """
        period = 1.0 / self._config.update_rate_hz
        due = time.monotonic()
        while True:
            self._desk.tick()
            now = time.monotonic()
            for page, line in self._lines.items():
                # What it holds is let go, as at the end of its line.
                if not line.is_away and now - line.heard > AWAY_S:
                    line.is_away = True
                    self._desk.left(page)
            snapshot = self._door.snapshot()
            silent_s = self._config.silent_ms * 1e-3
            silent = snapshot.is_silent(now, silent_s)
            alarms = active_alarms(snapshot, now, silent_s)
            self._desk.log.look(snapshot, silent, now)
            stamp = _clock()
            date, _, clock = stamp.partition("T")
            self.events.decisions(snapshot.decisions)
            self.events.alarms(alarms, stamp)
            self.events.ended(self._desk.log.take_ended(), stamp)
            self._today.look(snapshot, silent, date, clock, now)
            self._send(snapshot, alarms, now)
            for listener in self.listeners:
                listener(snapshot, silent)
            if not self._lines:
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self._watched.wait(), UNWATCHED_S)
                due = time.monotonic()
                continue
            # A look that came late is not made up for: pages would get many frames at once.
            due = max(due + period, time.monotonic())
            await asyncio.sleep(due - time.monotonic())

    def _send(self, snapshot: Snapshot, alarms: tuple[Alarm, ...], now: float) -> None:
        clock, t = time.time(), round(now, 3)
        points = self._maker.points(snapshot, t)
        today = self._today.texts(snapshot, t)
        make = partial(self._frame, snapshot, t, today)
        if self.past.is_due(clock):
            self.past.keep(PastMoment(clock, t, make, lambda: points, snapshot.parts))
        if not self._lines:
            self._history.add(t, points)
            return
        frame = make()
        if not self._history.add(frame.t, frame.point):
            # Between two points of the charts there is none: they have a rate of their own.
            frame = msgspec.structs.replace(frame, point={})
        # Encoded once, however many pages look.
        text = _message("frame", frame)
        lists = self._lists_text(alarms)
        for line in self._lines.values():
            line.put("frame", text)
            if lists != self._lists:
                line.put("lists", lists)
            if self.events.version != self._sent_events:
                line.put("events", _message("events", self.events.shown))
            if snapshot.parts is not self._parts:
                line.put("parts", _message("parts", snapshot.parts))
        self._lists, self._parts = lists, snapshot.parts
        self._sent_events = self.events.version

    def _frame(self, snapshot: Snapshot, now: float, today: dict[str, str]) -> Frame:
        """Make a frame; ``today`` is what :class:`Today` says at that time."""
        frame = self._maker.make(snapshot, now)
        frame.text.update(today)
        return frame

    def _lists_text(self, alarms: tuple[Alarm, ...]) -> str:
        content = {
            "alarms": alarms,
            "commands": self._desk.log.shown,
            "waiting": self.events.waiting,
        }
        return _message("lists", content)

    async def _serve(self, socket: WebSocket) -> None:
        page = socket.query_params.get("page", "")
        await socket.accept()
        if page not in self._desk.sessions:
            await socket.close(UNKNOWN_PAGE, "this page is not known: load it again")
            return
        before, line = self._lines.get(page), _Line(socket)
        self._lines[page] = line
        self._watch()
        if before is not None:  # its line broke without a word, and it is here again
            background_tasks.create(before.socket.close(), name="close")
        tab = socket.query_params.get("tab", "")
        self._desk.arrived(page, tab)
        line.put("history", _message("history", self._history.rows))
        snapshot = self._door.snapshot()
        now = time.monotonic()
        alarms = active_alarms(snapshot, now, self._config.silent_ms * 1e-3)
        line.put("lists", self._lists_text(alarms))
        line.put("events", _message("events", self.events.shown))
        line.put("parts", _message("parts", snapshot.parts))
        sender = asyncio.create_task(_pump(line))
        try:
            while True:
                packet = await socket.receive_json()
                line.heard = time.monotonic()
                known = page in self._desk.sessions and self._lines.get(page) is line
                if line.is_away and known:
                    line.is_away = False
                    self._desk.arrived(page, tab)
                await self._hear(page, packet, line)
        except (WebSocketDisconnect, RuntimeError, ValueError):
            pass  # the page is gone, or speaks nonsense: both end its connection
        finally:
            sender.cancel()
            # Only if it is still ours: a page that came back has put its new line here meanwhile.
            if self._lines.get(page) is line:
                del self._lines[page]
                self._desk.left(page)
                self._watch()

    def _watch(self) -> None:
        """Tell those who listen for the pages whether there is one."""
        self._door.watch(bool(self._lines))
        if self._lines:
            self._watched.set()
        else:
            self._watched.clear()

    async def _hear(self, page: str, packet: Any, line: _Line) -> None:
        """Act on what a page says: a sign of a held button, its release, STOP or E-STOP."""
        match packet:
            case {"alive": int()}:
                pass
            case {
                "hold": int(press),
                "joint": str(joint),
                "direction": int(direction),
                "percent": int() | float() as percent,
            }:
                refused = self._desk.hold(page, press, joint, direction, float(percent))
                self._tell_refused(page, press, refused, line)
            case {
                "hold": int(press),
                "axis": str(axis),
                "frame": str(frame),
                "direction": int(direction),
                "fast": bool(fast),
            }:
                refused = self._desk.hold_tool(page, press, axis, frame, direction, fast)
                self._tell_refused(page, press, refused, line)
            case {
                "hold": int(press),
                "guide": [int() | float() as x, int() | float() as y],
            } if math.isfinite(x) and math.isfinite(y):
                refused = self._desk.guide(page, press, (float(x), float(y)))
                self._tell_refused(page, press, refused, line)
            case {"release": int(press)}:
                self._desk.let_go(page, press)
            case {"acknowledge": int(number)}:
                if self._operates(page):
                    self.events.acknowledge(number, self._desk.name_of(page), _clock())
            case {"stop": "STOP" | "ESTOP" as command, "press": int(press)}:
                # Beside the hearing: what is let go meanwhile is heard.
                background_tasks.create(self._stop(page, command, press, line), name=command)
            case _:
                raise ValueError(f"unknown packet {packet!r}")

    def _operates(self, page: str) -> bool:
        """Return whether a page may change anything, also what all pages are told."""
        session = self._desk.sessions.get(page)
        return session is not None and session.role is Role.OPERATOR

    def _tell_refused(self, page: str, press: int, refused: str, line: _Line) -> None:
        """Say once why a held button moves nothing."""
        if refused:
            if self._operates(page):
                self._desk.note_once(page, press, "Jog", Answer(False, refused))
            line.put("refused", _message("refused", {"press": press, "why": refused}))

    async def _stop(self, page: str, command: str, press: int, line: _Line) -> None:
        """Stop, and tell the page in time what is known of it; then what came late."""

        def tell(answer: Answer) -> None:
            content = {
                "command": command,
                "press": press,
                "confirmed": bool(answer.values.get("confirmed")),
                "success": answer.success,
                "text": answer.message,
            }
            line.put(f"stopped {command} {press}", _message("stopped", content))

        try:
            sent = asyncio.ensure_future(self._desk.stop(page, command))
            done, _ = await asyncio.wait({sent}, timeout=ANSWER_S)
            if not done:
                tell(not_confirmed("the twin controller has not answered yet"))
            tell(await sent)
        except Exception as error:
            LOG.exception("%s of page %s", command, page)
            tell(not_confirmed(f"the page failed: {error}"))


async def _pump(line: _Line) -> None:
    try:
        while True:
            for text in await line.take():
                await line.socket.send_text(text)
    except (WebSocketDisconnect, RuntimeError, OSError):
        pass  # the other half of the connection notices too


def _clock() -> str:
    return datetime.now().isoformat(timespec="seconds")


def _message(kind: str, content: object) -> str:
    return _ENCODE({kind: content}).decode()
