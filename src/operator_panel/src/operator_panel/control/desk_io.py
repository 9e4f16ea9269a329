"""The desk where all open pages meet: who is there, who commands, whose button is held."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from scara_ros.names import Seat

from operator_panel.control import authority
from operator_panel.control.authority import ENDING, Role
from operator_panel.control.guide import GuidedTool
from operator_panel.control.jog import DeadMan, JogError
from operator_panel.control.steps import StepError, positions_now
from operator_panel.control.tool_jog import ToolArm
from operator_panel.door import Answer, CellDoor
from operator_panel.view import words
from operator_panel.view.progress import CommandLog
from operator_panel.view.snapshot import CellState

LOG = logging.getLogger(__name__)
MOST_WATCHERS = 32  # our choice: a page costs 1.4 MB, and whoever reaches the port may watch
KEPT_S = 60.0  # as long as nicegui keeps a page that never connects
SIGNS = 5  # our choice: so many signs of life in the time after which control is lost
JOGS_S = 2.0  # our choice: so long after a jog the twin still runs out
NOBODY = Seat()
Say = Callable[[str], None]


@dataclass
class Session:
    """One open page.

    Attributes:
        page: Its id.
        role: Operator or viewer.
        seat: The person at it, as the twin controller knows it; empty for a viewer.
        tab: Id of the browser tab; stays when the page is loaded again.
        there: Whether its live connection is open.
        seen: When it was opened or lost.
        commanded: When it has commanded last, or taken control, or its motion or draft still ran.
        holds: It held control at the last look.
        jogged: When a jog button of it was held last.
        moves: The twin controller knows that this page moves the twin.
    """

    page: str
    role: Role
    seat: Seat = NOBODY
    tab: str = ""
    there: bool = False
    seen: float = field(default_factory=time.monotonic)
    commanded: float = float("-inf")
    holds: bool = False
    jogged: float = float("-inf")
    moves: bool = False

    @property
    def name(self) -> str:
        """For people."""
        return self.seat.name or "viewer"


class PageDesk:
    """Tells the twin controller who is at which page; that judges who may command.

    All but the jog runs in one thread.
    """

    def __init__(
        self,
        door: CellDoor,
        dead_man: DeadMan,
        arm: ToolArm,
        keep_s: float,
        let_go_s: float,
        silent_s: float,
        say: Say,
    ) -> None:
        """Start with nobody there.

        Args:
            door: The cell.
            dead_man: The rule of jogging.
            arm: What moves the tool.
            keep_s: Without a sign of life for so long control is lost [s].
            let_go_s: So long after its last command a page lets go of control [s].
            silent_s: The twin controller is silent after so long [s].
            say: Logs what was commanded by whom.
        """
        self.sessions: dict[str, Session] = {}
        self.log = CommandLog()
        # The press whose refusal was shown: a held button gives signs all the while.
        self._noted = ("", 0)
        self._door, self._keep_s, self._let_go_s, self._say = door, keep_s, let_go_s, say
        self._dead_man, self.arm, self._silent_s = dead_man, arm, silent_s
        self.taught = 0  # how often a page has written frames.yaml: all pages look at it
        # The jog runs in a thread of its own, so that a busy page cannot keep a joint moving.
        self._lock = threading.Lock()
        # Ends a wait for the next sign of life, for a holder that is back or begins to jog.
        self._wake = asyncio.Event()
        # Wakes the jog, which sleeps while no button is held.
        self._pressed = threading.Event()

    def open(self, page: str, role: Role, person: str = "") -> Session:
        """Note a page that is being built; ``person`` has brought the token."""
        seat = NOBODY
        if role is Role.OPERATOR:
            seat = Seat(person or role.value, str(self._free_number()))
        self.sessions[page] = Session(page, role, seat)
        return self.sessions[page]

    def _free_number(self) -> int:
        """Return the smallest number that no page uses, or has used while control is remembered."""
        now = time.monotonic()
        used = {
            session.seat.session
            for session in self.sessions.values()
            if session.there or now - session.seen < 2.0 * self._keep_s
        }
        return next(number for number in itertools.count(1) if str(number) not in used)

    def crowded(self) -> str:
        """Return why nobody else may watch, or an empty text; operators are always let in."""
        watchers = sum(session.role is Role.VIEWER for session in self.sessions.values())
        if watchers < MOST_WATCHERS:
            return ""
        return f"{watchers} pages watch already: close one, or open the operator's address"

    def arrived(self, page: str, tab: str) -> None:
        """Note that a page's live connection is open; it watches until its first command."""
        session = self.sessions[page]
        if not session.tab:
            # A page that was loaded again gets the seat of its former self, the last in this tab.
            for old in self.sessions.values():
                same = old is not session and not old.there and tab and old.tab == tab
                if same and old.seat.person == session.seat.person:
                    session.seat, old.seat = old.seat, session.seat
                    session.commanded, session.holds = old.commanded, old.holds
        session.there, session.tab, session.seen = True, tab, time.monotonic()
        self._wake.set()  # a holder that is back gives its sign of life at once

    def left(self, page: str) -> None:
        """Note that a page's live connection is gone; what it moves stops at once."""
        with self._lock:
            self._dead_man.forget(page)
        if page in self.sessions:
            session = self.sessions[page]
            session.there, session.moves = False, False
            session.seen = time.monotonic()

    def tick(self) -> None:
        """Let time pass."""
        now = time.monotonic()
        gone = [s.page for s in self.sessions.values() if not s.there and now - s.seen > KEPT_S]
        for page in gone:
            del self.sessions[page]

    async def keep_control(self) -> None:
        """Give the signs of life of all pages that are there, until cancelled."""
        while True:
            await self.give_signs()
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._wake.wait(), self._keep_s / SIGNS)
            self._wake.clear()

    async def give_signs(self) -> None:
        """Say for each page that holds control, or asks for it, that it is there."""
        for session in list(self.sessions.values()):
            action = self._due(session, self._door.snapshot().state, time.monotonic())
            if action:
                await self._ask(session, action)

    def _due(self, session: Session, state: CellState | None, now: float) -> str:
        """Return what a page has to say of control now, or an empty text."""
        if state is None or not session.there or session.role is not Role.OPERATOR:
            return ""
        held, session.holds = session.holds, session.name == state.holder
        if session.holds:
            if not held or state.mode not in authority.AT_REST:
                session.commanded = max(now, session.commanded)
            idle_s = now - session.commanded
            return "RELEASE" if authority.lets_go(state, idle_s, self._let_go_s) else "KEEP"
        if session.name == state.asker:
            return "KEEP"
        jogs = now - session.jogged < JOGS_S
        return "TAKE" if jogs and not state.holder else ""

    async def _ask(self, session: Session, action: str) -> Answer:
        """Send one action; with it goes whether this page moves the twin."""
        moves = time.monotonic() - session.jogged < JOGS_S
        # While the answer is on its way nothing counts on what was known before.
        session.moves = session.moves and moves
        answer = await self._door.control(session.seat, action, moves)
        session.moves = moves and answer.success
        return answer

    async def take(self, page: str) -> str:
        """Take control for a command if nobody holds it; return why the page may not command."""
        session, state = self.sessions.get(page), self._door.snapshot().state
        refused = self.refusal(page)
        if refused or session is None or state is None:
            return refused
        session.commanded = time.monotonic()
        if state.holder == session.name:
            return ""
        answer = await self._ask(session, "TAKE")
        return "" if answer.success else answer.message

    async def ask(self, page: str) -> Answer:
        """Take control if it is free, else ask its holder."""
        return await self._ask(self.sessions[page], "ASK")

    async def answer(self, page: str, granted: bool) -> Answer:
        """Grant or keep control."""
        session = self.sessions[page]
        if not granted:
            return await self._ask(session, "DENY")
        self.stop_jog()
        return await self._ask(session, "GIVE")

    def name_of(self, page: str) -> str:
        """Return the name of a page for people."""
        session = self.sessions.get(page)
        return session.name if session is not None else "nobody"

    def refusal(self, page: str, command: str = "") -> str:
        """Return why ``page`` may not command, whatever the cell does; empty if it may."""
        session = self.sessions.get(page)
        if session is None:
            return "this page is not known any more: load it again"
        if command in ENDING:
            return ""
        return authority.refusal(session.role, session.name, self._door.snapshot().state)

    def stop(self, page: str, command: str) -> Awaitable[Answer]:
        """Send STOP or ESTOP of any page, and end a held jog; see :meth:`CellDoor.stop`.

        Whoever sees the page may end a motion; only the operator in control may begin one.
        """
        session = self.sessions.get(page)
        seat = session.seat if session is not None else NOBODY
        answer = self._door.stop(seat, command)  # before all else that could fail or take time
        try:
            self.stop_jog()
            answer = self._logged(page, command, answer)
            self._say(f"{self.name_of(page)}: {command}")
        except Exception:
            # The press is on its way and its answer is what counts. A joint that gets no zero stops
            # by its own time-out. logging survives a full disk, print does not.
            LOG.exception("%s was sent; what belongs to it failed", command)
        return answer

    async def command(self, page: str, command: str, title: str = "", **fields: Any) -> Answer:
        """Send another command of ``page``; whether its person may, the twin controller says.

        One that begins something takes control first, if nobody holds it.
        """
        return (await self.begin_command(page, command, title, **fields))[1]

    async def begin_command(
        self, page: str, command: str, title: str = "", **fields: Any
    ) -> tuple[int, Answer]:
        """Do as :meth:`command`; return its number in the log too, to follow its motion."""
        # As old as its press: a stop may come while control is taken.
        asked = fields.pop("asked", time.monotonic())
        number = self.begin(page, command, title or words.command_title(command, fields))
        session = self.sessions.get(page)
        refused = "" if command in ENDING else await self.take(page)
        if session is None or refused:
            answer = Answer(False, refused or self.refusal(page))
        else:
            self._say(f"{session.name}: {command} {fields or ''}".rstrip())
            answer = await self._door.command(session.seat, command, asked=asked, **fields)
        self.ended(number, answer)
        return number, answer

    def begin(self, page: str, kind: str, title: str) -> int:
        """Show a command that ``page`` sends now; return its number."""
        clock = datetime.now().strftime("%H:%M:%S")
        return self.log.begin(kind, title, self.name_of(page), clock, time.monotonic())

    def ended(self, number: int, answer: Answer) -> None:
        """Show the answer to a command; a motion is followed from here to its end."""
        self.log.answered(number, answer, time.monotonic())

    def note(self, page: str, title: str, answer: Answer) -> None:
        """Show something that was asked for and answered at once."""
        self.ended(self.begin(page, title, title), answer)

    def note_once(self, page: str, press: int, title: str, answer: Answer) -> None:
        """Show the refusal of a held button once, not at each of its signs."""
        if self._noted != (page, press):
            self._noted = (page, press)
            self.note(page, title, answer)

    async def _logged(self, page: str, command: str, answer: Awaitable[Answer]) -> Answer:
        """Show a stop; the answer is passed on unchanged."""
        number = self.begin(page, command, words.command_title(command, {}))
        found = await answer
        self.ended(number, found)
        return found

    def hold(self, page: str, press: int, joint: str, direction: int, speed_percent: float) -> str:
        """Take a sign of a held jog button; return why it does not count, or an empty text.

        The first sign tells the twin controller that the motion is this page's; what it does not
        know by then it would stop. The signs that follow move the joint.
        """

        def take(now: float) -> None:
            self._dead_man.hold(page, press, joint, direction, speed_percent, now)

        return self._held(page, press, take)

    def hold_tool(
        self, page: str, press: int, axis: str, frame: str, direction: int, fast: bool
    ) -> str:
        """Take a sign of a held button that moves the tool; as :meth:`hold`."""

        def take(now: float) -> None:
            way = self.arm.held(axis, frame, direction, fast)
            self._dead_man.hold_way(page, press, way, now)

        return self._held(page, press, take)

    def guide(self, page: str, press: int, pointer: tuple[float, float]) -> str:
        """Take a sign of a pointer that drags the tool, in the base [m]; as :meth:`hold`."""

        def take(now: float) -> None:
            self._dead_man.hold_way(page, press, GuidedTool(self.arm, pointer), now)

        return self._held(page, press, take)

    def _held(self, page: str, press: int, take: Callable[[float], None]) -> str:
        snapshot, now = self._door.snapshot(), time.monotonic()
        refused = self.refusal(page) or authority.command_refusal(
            "JOG", snapshot.refused(), snapshot.is_silent(now, self._silent_s)
        )
        with self._lock:
            if refused:
                self._dead_man.release(page, press)
                return refused
            session = self.sessions[page]
            session.jogged = session.commanded = now
            if not session.moves:
                self._wake.set()
                return ""
            try:
                take(now)
            except JogError as error:
                return str(error)
        self._pressed.set()
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

    def jog_tick(self) -> bool:
        """Send what is held now; return whether a button is held.

        A thread of its own calls this, so that a busy page cannot keep a joint moving.
        """
        with self._lock:
            self._send()
            return bool(self._dead_man.page)

    def wait_for_press(self, timeout: float) -> None:
        """Wait until a button is held, or for ``timeout`` [s]."""
        self._pressed.wait(timeout)
        self._pressed.clear()

    def _send(self) -> None:
        velocities = self._dead_man.tick(time.monotonic(), self._where)
        if velocities:
            self._door.jog(velocities)

    def _where(self) -> dict[str, float]:
        """Return where the twin's joints are, for what is jogged along a line."""
        try:
            return positions_now(self.arm.robot, self._door.snapshot())
        except StepError as error:
            raise JogError(str(error)) from error
