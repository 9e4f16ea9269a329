"""Ask cells for STOP, PAUSE and the rest, all at once; each answers for itself."""

from __future__ import annotations

import contextlib
import queue
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import zenoh

from farm.keys import ALIVE, COMMAND, CellName, CellNameError, every, owner
from farm.wire import Answer, Command, WireError, decode, encode

MARGIN_S = 0.2
"""Our choice: so long after its expiry an answer may still be on its way."""


class Answered(NamedTuple):
    """What one cell said, or that it said nothing.

    Attributes:
        cell: Which.
        answer: What it said; None: nothing.
        seconds: After the question.
    """

    cell: CellName
    answer: Answer | None
    seconds: float

    @property
    def text(self) -> str:
        """One line for people."""
        if self.answer is None:
            return f"{self.cell}: NO ANSWER within {self.seconds:.1f} s: look at the cell itself"
        word = "" if self.answer.accepted else "REFUSED: "
        return f"{self.cell}: {word}{self.answer.text or 'done'} ({1000.0 * self.seconds:.0f} ms)"


def cells_there(session: zenoh.Session, site: str, timeout_s: float) -> list[CellName]:
    """Return the cells whose links are there; the router knows, whatever the desk does."""
    there = []
    for reply in session.liveliness().get(every(site, ALIVE), timeout=timeout_s):
        # A machine declares what it likes under its own name. What names no cell must not keep a
        # STOP from all others.
        with contextlib.suppress(CellNameError):
            if reply.ok is not None:
                there.append(owner(str(reply.ok.key_expr)))
    return sorted(there)


def order(
    session: zenoh.Session,
    cells: Sequence[CellName],
    command: str,
    person: str,
    desk: str,
    expiry_s: float,
    clock: Callable[[], float] = time.time,
) -> Iterator[Answered]:
    """Ask all cells at once, and yield what they answer, as it comes.

    It is asked once. A cell that does not answer is yielded at the end.

    Args:
        session: An open session.
        cells: Whom to ask.
        command: What for; as in :class:`farm.wire.Command`.
        person: Who asks.
        desk: From which machine.
        expiry_s: The cells take it for so long.
        clock: This machine's time [s since 1970].
    """
    now = clock()
    asked = {
        cell: Command(uuid.uuid4().hex, command, person, desk, now + expiry_s, asked=now)
        for cell in cells
    }
    return ask(session, asked, expiry_s)


def ask(
    session: zenoh.Session,
    asked: Mapping[CellName, Command],
    answer_s: float,
    priority: zenoh.Priority = zenoh.Priority.REAL_TIME,
) -> Iterator[Answered]:
    """Ask each cell its own question, all at once, and yield what they answer, as it comes.

    Args:
        session: An open session.
        asked: What each is asked.
        answer_s: An answer is waited for so long.
        priority: Of the questions on the bus.
    """
    # Answers come in threads of zenoh; the queue hands them to this one.
    answers: queue.SimpleQueue[tuple[CellName, Answer | None]] = queue.SimpleQueue()
    begun = time.monotonic()
    for cell, command in asked.items():
        _ask(session, cell, command, answer_s, priority, answers)
    waiting = set(asked)
    while waiting:
        try:
            left = answer_s + MARGIN_S - (time.monotonic() - begun)
            cell, answer = answers.get(timeout=max(0.0, left))
        except queue.Empty:
            break
        # Behind its answer each question ends with a None, which says nothing then.
        if cell in waiting:
            waiting.discard(cell)
            yield Answered(cell, answer, time.monotonic() - begun)
    for cell in sorted(waiting):
        yield Answered(cell, None, time.monotonic() - begun)


def _ask(
    session: zenoh.Session,
    cell: CellName,
    command: Command,
    answer_s: float,
    priority: zenoh.Priority,
    answers: queue.SimpleQueue[tuple[CellName, Answer | None]],
) -> None:
    """Ask one cell; its answer comes into the queue, None when no more can come."""

    def take(reply: zenoh.Reply) -> None:
        answer = None  # zenoh gave up
        if reply.ok is not None:
            try:
                answer = decode(bytes(reply.ok.payload), Answer)
            except WireError as error:
                answer = Answer(False, f"its answer cannot be read: {error}")
        answers.put((cell, answer))

    session.get(
        cell.key(COMMAND),
        zenoh.handlers.Callback(take, lambda: answers.put((cell, None))),
        payload=encode(command),
        timeout=answer_s,
        priority=priority,
        # A command waits for room on the line; what only shows something is dropped instead.
        congestion_control=zenoh.CongestionControl.BLOCK,
    )
