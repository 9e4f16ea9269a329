"""The desk where all open pages meet: who is there, who may command, whose button is held."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from operator_panel.config import Control
from operator_panel.control import authority, commands
from operator_panel.control.authority import Authority, Role
from operator_panel.control.jog import DeadMan, JogError
from operator_panel.door import Answer, CellDoor

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
    """Judges who may command; what is commanded is judged by the twin controller. All but the jog runs in one thread."""

    def __init__(self, door: CellDoor, dead_man: DeadMan, config: Control, silent_s: float, say: Say) -> None:
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

    def arrived(self, page: str, tab: str) -> None:
        """Note that a page's live connection is open; a free control is taken."""
        session = self.sessions[page]
        session.there, session.tab = True, tab
        old = self.sessions.get(self.state.holder)
        if old is not None and old.page != page and not old.there and tab and old.tab == tab and session.role is Role.OPERATOR:
            self.state = authority.inherited(self.state, old.page, page)
        self.state = authority.returned(self.state, page)
        if not self.state.holder or self.state.left is not None:
            self.ask(page)  # of a page that is gone nobody answers: it gets control when that does not come back

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
        gone = [s.page for s in self.sessions.values() if not s.there and now - s.seen > 60.0 and s.page != self.state.holder]
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

    def refusal(self, page: str, command: str) -> str:
        """Return why ``page`` may not send ``command``, whatever the cell does; an empty text if it may."""
        session = self.sessions.get(page)
        if session is None:
            return "this page is not known any more: load it again"
        return authority.refusal(self.state, page, session.role, command not in commands.WITHOUT_CONTROL)

    async def command(self, page: str, command: str, **fields: Any) -> Answer:
        """Send a command of ``page`` to the twin controller."""
        refused = self.refusal(page, command)
        if refused:
            return Answer(False, refused)
        if command in commands.WITHOUT_CONTROL:
            self.stop_jog()
        self._say(f"{self.name_of(page)}: {command} {fields or ''}".rstrip())
        return await self._door.command(command, **fields)

    def hold(self, page: str, press: int, joint: str, direction: int, speed_percent: float) -> str:
        """Take a sign of a held jog button; return why it does not count, or an empty text."""
        snapshot, now = self._door.snapshot(), time.monotonic()
        mode = snapshot.state.mode if snapshot.state is not None else ""
        refused = self.refusal(page, "JOG") or commands.refusal("JOG", mode, False, snapshot.is_silent(now, self._silent_s))
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
        """Send what is held now; called by a thread of its own, so that a busy page cannot keep a joint moving."""
        with self._lock:
            self._send()

    def _send(self) -> None:
        velocities = self._dead_man.tick(time.monotonic())
        if velocities:
            self._door.jog(velocities)
