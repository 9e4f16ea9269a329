"""The desk where all open pages meet: who is there, who may command, whose button is held."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from operator_panel.config import Control
from operator_panel.control import authority, commands
from operator_panel.control.authority import Authority, Role
from operator_panel.control.jog import DeadMan, JogError
from operator_panel.door import Answer, CellDoor

LOG = logging.getLogger(__name__)
MOST_WATCHERS = 32  # our choice: a page costs 1.4 MB, and whoever reaches the port may watch
KEPT_S = 60.0  # as long as nicegui keeps a page that never connects
Say = Callable[[str], None]


@dataclass
class Session:
    """One open page.

    Attributes:
        page: Its id.
        role: Operator or viewer.
        name: For people.
        tab: Id of the browser tab; stays when the page is loaded again.
        there: Whether its live connection is open.
    """

    page: str
    role: Role
    name: str
    tab: str = ""
    there: bool = False
    seen: float = field(default_factory=time.monotonic)


class Desk:
    """Judges who may command; the twin controller judges what is commanded.

    All but the jog runs in one thread.
    """

    def __init__(
        self, door: CellDoor, dead_man: DeadMan, config: Control, silent_s: float, say: Say
    ) -> None:
        """Start with nobody there. ``say`` logs what was commanded by whom."""
        self.sessions: dict[str, Session] = {}
        self.state = Authority()
        self._door, self._dead_man, self._config, self._say = door, dead_man, config, say
        self._silent_s = silent_s
        self._count = 0
        self._lock = threading.Lock()

    def open(self, page: str, role: Role) -> Session:
        """Note a page that is being built."""
        self._count += role is Role.OPERATOR
        name = f"operator {self._count}" if role is Role.OPERATOR else "viewer"
        self.sessions[page] = Session(page, role, name)
        return self.sessions[page]

    def crowded(self) -> str:
        """Return why nobody else may watch, or an empty text; operators are always let in."""
        watchers = sum(session.role is Role.VIEWER for session in self.sessions.values())
        if watchers < MOST_WATCHERS:
            return ""
        return f"{watchers} pages watch already: close one, or open the operator's address"

    def arrived(self, page: str, tab: str) -> None:
        """Note that a page's live connection is open; a free control is taken."""
        session = self.sessions[page]
        session.there, session.tab = True, tab
        old = self.sessions.get(self.state.holder)
        if (
            old is not None
            and old.page != page
            and not old.there
            and tab
            and old.tab == tab
            and session.role is Role.OPERATOR
        ):
            self.state = authority.inherited(self.state, old.page, page)
        self.state = authority.returned(self.state, page)
        if not self.state.holder or self.state.left is not None:
            self.ask(
                page
            )  # of a page that is gone nobody answers: it gets control when that does not come back

    def left(self, page: str) -> None:
        """Note that a page's live connection is gone; what it holds is released at once."""
        with self._lock:
            self._dead_man.forget(page)
        if page in self.sessions:
            self.sessions[page].there = False
            self.sessions[page].seen = time.monotonic()
            self.state = authority.lost(self.state, page, time.monotonic())

    def tick(self) -> None:
        """Let time pass."""
        now = time.monotonic()
        self.state = authority.passed(self.state, now, self._config.answer_s, self._config.return_s)
        gone = [
            s.page
            for s in self.sessions.values()
            if not s.there and now - s.seen > KEPT_S and s.page != self.state.holder
        ]
        for page in gone:
            del self.sessions[page]

    def ask(self, page: str) -> None:
        """Ask for control."""
        session = self.sessions[page]
        before = self.state.holder
        self.state = authority.ask(self.state, page, session.role, time.monotonic())
        if self.state.holder != before:
            self._say(f"{session.name} takes control")

    def answer(self, page: str, granted: bool) -> None:
        """Grant or keep control."""
        self.state = authority.answer(self.state, page, granted)
        if granted:
            self.stop_jog()

    def release(self, page: str) -> None:
        """Give control up."""
        with self._lock:
            self._dead_man.release(page)
        self.state = authority.release(self.state, page)

    def name_of(self, page: str) -> str:
        """Return the name of a page for people."""
        session = self.sessions.get(page)
        return session.name if session is not None else "nobody"

    def refusal(self, page: str) -> str:
        """Return why ``page`` may not command, whatever the cell does; empty if it may."""
        session = self.sessions.get(page)
        if session is None:
            return "this page is not known any more: load it again"
        return authority.refusal(self.state, page, session.role)

    def stop(self, page: str, command: str) -> Awaitable[Answer]:
        """Send STOP or ESTOP of any page, and end a held jog; see :meth:`CellDoor.stop`.

        Whoever sees the page may end a motion; only the operator in control may begin one.
        """
        answer = self._door.stop(command)  # before all else that could fail or take time
        try:
            self.stop_jog()
            self._say(f"{self.name_of(page)}: {command}")
        except Exception:
            # The press is on its way and its answer is what counts. A joint that gets no zero stops
            # by its own time-out. logging survives a full disk, print does not.
            LOG.exception("%s was sent; what belongs to it failed", command)
        return answer

    async def command(self, page: str, command: str, **fields: Any) -> Answer:
        """Send another command of ``page`` to the twin controller."""
        refused = self.refusal(page)
        if refused:
            return Answer(False, refused)
        self._say(f"{self.name_of(page)}: {command} {fields or ''}".rstrip())
        return await self._door.command(command, **fields)

    def hold(self, page: str, press: int, joint: str, direction: int, speed_percent: float) -> str:
        """Take a sign of a held jog button; return why it does not count, or an empty text."""
        snapshot, now = self._door.snapshot(), time.monotonic()
        refused = self.refusal(page) or commands.refusal(
            "JOG", snapshot.refused(), snapshot.is_silent(now, self._silent_s)
        )
        with self._lock:
            if refused:
                self._dead_man.release(page, press)
                return refused
            try:
                self._dead_man.hold(page, press, joint, direction, speed_percent, now)
            except JogError as error:
                return str(error)
        return ""

    def let_go(self, page: str, press: int) -> None:
        """Take the release of a jog button; the joint stops now, not at the next period."""
        with self._lock:
            self._dead_man.release(page, press)
            self._send()

    def stop_jog(self) -> None:
        """End whatever is held."""
        with self._lock:
            self._dead_man.stop()
            self._send()

    def jog_tick(self) -> None:
        """Send what is held now.

        A thread of its own calls this, so that a busy page cannot keep a joint moving.
        """
        with self._lock:
            self._send()

    def _send(self) -> None:
        velocities = self._dead_man.tick(time.monotonic())
        if velocities:
            self._door.jog(velocities)
