"""The desk's page: the wall of cells, alarms, events; STOP and PAUSE with the answers.

NiceGUI serves the page and its frame; the browser asks ``/farm/wall`` once a second, and sends a
command to ``/farm/command``, which answers with one line for each cell as it comes. So a STOP needs
no web socket, and ten pages cost ten times a text that was made once.
"""

from __future__ import annotations

import asyncio
import gzip
import signal
import threading
import time
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path

import msgspec
from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_guard_io import PageGuard
from scara_ros.page.page_library_io import (
    WebFolder,
    app,
    button_of,
    offer,
    plain,
    serve_pages,
    ui,
)
from scara_ros.page.page_token_io import PageError, listen
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse

from farm.desk.alarm_desk_io import MarksAsked
from farm.desk.class_io import SINCE_S, class_of
from farm.desk.commands_io import cells_there, order
from farm.desk.desk_io import Desk
from farm.desk.figures_io import (
    compare_cells,
    compare_weeks,
    figures_of,
    figures_over,
    stops_by_cause,
)
from farm.desk.questions import QuestionError, since
from farm.desk.reading_io import AskingError
from farm.desk.roster import not_reached
from farm.desk.wall import wall_of
from farm.keys import ChoiceError, choose
from farm.link.rights import ALWAYS
from farm.wire import WireError, decode

PAGE = "farm_desk"
KEPT_S = 0.4
"""Our choice: a wall so old is given to the next page too; pages ask once a second."""
PACKED = 1
"""Our choice: the level at which packing takes the least time."""
FIGURES_S = 25.0
"""Our choice: pages ask for the figures twice a minute; counting a large farm is work."""
LAST_WEEKS = ("1", "0")
"""The week before this one, and this one."""
COMMANDS = 40
"""Our choice: so many commands wait for their answers at once, each of them for 3 s at most."""
THERE_S = 0.5
"""Our choice: the router answers who is there within milliseconds."""


class PageRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a page asks for."""

    command: str
    cell: str


class Page:
    """Serves one desk's page."""

    def __init__(self, desk: Desk, site: str, web: Path, who: tuple[str, str], expiry_s: float):
        """Offer all routes; :func:`serve` begins.

        Args:
            desk: What is shown.
            site: Its site.
            web: Folder of farm.js and farm.css.
            who: Person and desk in whose name commands are sent.
            expiry_s: Of commands.
        """
        self._desk, self._site, self._who, self._expiry_s = desk, site, who, expiry_s
        self._made, self._wall, self._packed = 0.0, b"", b""
        self._counted, self._figures, self._counting = 0.0, b"", threading.Lock()
        # Threads of their own: what else a page asks for may wait for a disk that hangs.
        self._commands = ThreadPoolExecutor(COMMANDS, "command")
        self._web = WebFolder("/farm/web", web)
        offer("/farm/wall", self._show)
        offer("/farm/command", self._command, "POST")
        offer("/farm/figures", self._count)
        offer("/farm/compare", self._compare)
        offer("/farm/alarm", self._mark, "POST")
        ui.page("/", title=f"{site}: farm", response_timeout=10.0)(self._build)

    def wall(self, now: float) -> bytes:
        """Return what a page shows, as JSON; the same for all pages that ask at one time."""
        if now - self._made > KEPT_S:
            desk = self._desk
            recent = [(str(cell), event) for cell, event in reversed(tuple(desk.recent))]
            told = (recent, desk.trouble, desk.unreadable)
            made = wall_of(time.time(), desk.rows(), desk.alarm_rows(), *told)
            self._wall, self._made = msgspec.json.encode(made), now
            self._packed = gzip.compress(self._wall, PACKED)
        return self._wall

    def _show(self, request: Request) -> Response:
        """Give the wall; it is packed once for all pages, not by NiceGUI for each."""
        wall, kind = self.wall(time.monotonic()), "application/json"
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(wall, media_type=kind)
        return Response(self._packed, headers={"content-encoding": "gzip"}, media_type=kind)

    def _count(self) -> Response:
        """Count the figures, at most once in a while for all pages; this runs in a thread."""
        with self._counting:
            now = time.time()
            if now - self._counted > FIGURES_S:
                folder, day = self._desk.events_folder, 86400.0
                planned = self._desk.planned_run_time_s
                try:
                    kpi = figures_of(folder, now - day, now, planned)
                    stops = stops_by_cause(folder, now - day)
                    drifts = figures_over(folder, now - 30.0 * day, now, day)
                    learners = class_of(folder, now - SINCE_S)
                except AskingError as error:
                    return PlainTextResponse(str(error), 503)
                # As many digits as a picture shows.
                drifts = [
                    msgspec.structs.replace(d, values=tuple(float(f"{v:.4g}") for v in d.values))
                    for d in drifts
                ]
                found = {"kpi": kpi, "causes": stops, "drifts": drifts, "learners": learners}
                self._figures = msgspec.json.encode(found)
                # Nothing costs nothing to count: cells that come are shown by the next page.
                self._counted = now if kpi else 0.0
            return Response(self._figures, media_type="application/json")

    def _compare(self, a: str, b: str = "", begin: str = "7d") -> Response:
        """Compare two cells since ``begin``, or a cell's last two weeks; this runs in a thread."""
        folder, now = self._desk.events_folder, datetime.now()
        try:
            if b:
                found = compare_cells(folder, (a, b), since(begin, now), now.timestamp())
            else:
                found = compare_weeks(folder, a, LAST_WEEKS, now)
        except (AskingError, QuestionError) as error:
            return PlainTextResponse(str(error), 409)
        return Response(msgspec.json.encode(found), media_type="application/json")

    async def _mark(self, request: Request) -> Response:
        """Acknowledge or shelve equal alarms in the name of who started the desk."""
        try:
            asked = decode(await request.body(), MarksAsked)
        except WireError as error:
            return PlainTextResponse(str(error), 400)
        answer = await run_in_threadpool(self._desk.alarms.mark, asked, "@".join(self._who))
        return PlainTextResponse(answer.text, 200 if answer.accepted else 409)

    async def _command(self, request: Request) -> Response:
        try:
            asked = decode(await request.body(), PageRequest)
        except WireError as error:
            return PlainTextResponse(str(error), 400)
        if asked.command not in ALWAYS:
            return PlainTextResponse(f"{asked.command}: allowed are {', '.join(ALWAYS)}", 400)
        lines = self._as_they_come(self._answers(asked))
        return StreamingResponse(lines, media_type="application/x-ndjson")

    async def _as_they_come(self, lines: Iterator[bytes]) -> AsyncIterator[bytes]:
        loop = asyncio.get_running_loop()
        while line := await loop.run_in_executor(self._commands, next, lines, b""):
            yield line

    def _answers(self, asked: PageRequest) -> Iterator[bytes]:
        """Yield what each cell says, a line each; this runs in a thread of its own."""
        there = cells_there(self._desk.session, self._site, THERE_S)
        try:
            chosen = choose(asked.cell, there)
        except ChoiceError as error:
            yield _line(asked.cell, False, str(error), 0.0)
            chosen = []
        person, desk = self._who
        answers = order(self._desk.session, chosen, asked.command, person, desk, self._expiry_s)
        for answered in answers:
            good = answered.answer is not None and answered.answer.accepted
            yield _line(str(answered.cell), good, answered.text, answered.seconds)
        # Last: those that are there wait for nobody.
        for row in not_reached(self._desk.rows(), there) if asked.cell == "all" else ():
            text = f"{row.name}: NOT REACHED: use the {asked.command} at the cell"
            yield _line(row.name, False, text, 0.0)

    def _build(self) -> None:
        """Build one page."""
        self._web.add("farm.css", "farm.js")
        with ui.element("header").classes("bar"):
            with ui.element("div").classes("bar-title"):
                plain(f"Farm {self._site}", "", "h1")
                plain("connecting", "summary").props('id=summary role="status"')
            plain("", "clock").props('id=clock aria-label="clock of the desk"')
            button_of("Alarms", "button to-alarms", "id=to-alarms")
            with ui.element("div").classes("bar-all"):
                for command in reversed(ALWAYS):
                    named = f'data-command={command} data-cell=all aria-label="{command} all"'
                    button_of(f"{command} ALL", f"button {command.lower()} all", named)
            with ui.element("div").classes("bar-worst"):
                ui.element("ol").classes("chips").props('id=worst aria-label="The worst cells"')
                button_of("", "button more", "id=more")
            plain("", "banner hidden", "div").props('id=banner role="alert"')
        with ui.element("div").classes("grid"):
            with ui.element("section").classes("wall-place").props('aria-label="Cells"'):
                ui.element("div").classes("wall").props("id=wall")
            with ui.element("aside").classes("side"):
                # Build alarms, answers and events; each scrolls in a place of its own
                with _card("Alarms", "", "alarm-count").classes("alarms-card"):
                    ui.element("ol").classes("alarms").props("id=alarms")
                with _card("Answers", f"Commands are sent as {'@'.join(self._who)}."):
                    ui.element("ol").classes("answers").props('id=answers aria-live="polite"')
                with _card("Events"):
                    ui.element("ol").classes("events").props("id=events")
            with ui.element("div").classes("below"):
                # Build figures of longer times
                about = "empty: not known. Renewed twice a minute."
                with _card("Key figures of 24 hours", about, "figures-trouble"):
                    ui.element("div").classes("figures-scroll").props("id=kpi")
                with _card("What stopped them, 24 hours"):
                    ui.element("ol").classes("renewed").props("id=causes")
                with _card("Away from their own past, 30 days"):
                    ui.element("ol").classes("renewed").props("id=drifts")
                    ui.element("div").classes("drift-picture").props("id=drift-picture")
                with _card("Configuration", "changes that were rolled out: ./cell farm rollout"):
                    ui.element("ol").classes("renewed").props("id=configurations")
                about = "exercises that were passed, and how often each was marked; 30 days"
                # Most farms hold no class.
                with _card("Class", about).classes("hidden").props("id=class-card"):
                    ui.element("div").classes("figures-scroll").props("id=class")
                with _card("Compare", "two cells, or two weeks of one"):
                    ui.element("div").classes("compare-form").props("id=compare-form")
                    ui.element("div").classes("figures-scroll").props("id=compared role=status")


def serve(host: str, port: int, token: str, title: str, told: str) -> None:
    """Serve the page until SIGINT or SIGTERM.

    Args:
        host: Where to listen.
        port: The port.
        token: Who brings it in the address is let in.
        title: Of the page.
        told: The address, printed when it can be opened.

    Raises:
        PageError: Something else listens there.
    """
    try:
        listen(host, port).close()
    except PageError as error:
        hint = "give another port, ./cell farm --port, or desk.port in farm.yaml"
        raise PageError(f"{error}: {hint}") from error
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: None)  # uvicorn ends by them, then raises them again
    app.add_middleware(PageGuard, door=PageDoor(PAGE, host, port, token))

    def tell() -> None:
        print(f"farm: {told}", flush=True)

    serve_pages(host, port, title, tell, dark=None, reconnect_timeout=5.0)


def _card(title: str, about: str = "", changes: str = "") -> ui.element:
    """Begin a card.

    Args:
        title: Its heading.
        about: Stands beside it.
        changes: Id of a text beside it that the page changes; empty: there is no such text.
    """
    card = ui.element("section").classes("card").props(f'aria-label="{title}"')
    with card, ui.element("div").classes("card-head"):
        plain(title, "", "h2")
        if about:
            plain(about, "muted")
        if changes:
            plain("", "muted").props(f"id={changes}")
    return card


def _line(cell: str, good: bool, text: str, seconds: float) -> bytes:
    line = {"cell": cell, "good": good, "text": text, "seconds": seconds}
    return msgspec.json.encode(line) + b"\n"
