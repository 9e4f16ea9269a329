"""What became of each command, in words, until its end; pure.

The twin controller answers a command when it begins. Whether a motion reached its target is told
later by the mode, so the newest commands are followed until they end.
"""

from __future__ import annotations

from collections import deque

import msgspec
from scara_config.text_enum import StrEnum
from scara_ros.page import page_words

from operator_panel.door import Answer
from operator_panel.view.snapshot import CellState, Snapshot
from scara_msgs.msg import TwinControllerState as Mode

KEPT = 50
SHOWN = 2
GRACE_S = 1.0  # our choice: the new mode is published at once; this is 20 periods of the state
PROGRAM_GRACE_S = 3.0  # our choice: a program's first line may wait before it moves
RESET_S = 5.0  # our choice: the robot resets its drives in less


class Fate(StrEnum):
    """Where a command is; from DONE on it has ended."""

    SENT = "sent"
    RUNNING = "running"
    PAUSED = "paused"
    DONE = "done"
    STOPPED = "stopped"
    REFUSED = "refused"
    LOST = "lost"


ENDED = frozenset({Fate.DONE, Fate.STOPPED, Fate.REFUSED, Fate.LOST})
TONES = {
    Fate.SENT: "busy",
    Fate.RUNNING: "busy",
    Fate.PAUSED: "warn",
    Fate.DONE: "good",
    Fate.STOPPED: "warn",
    Fate.REFUSED: "bad",
    Fate.LOST: "bad",
}
HALTED = frozenset({Mode.STOPPED, Mode.STANDSTILL, Mode.ESTOP, Mode.FAULT})
# A stop that has succeeded is no good news of a motion: it is never green.
NEVER_GREEN = frozenset({"STOP", "ESTOP", "PAUSE", "STANDSTILL"})
# command: (mode while it runs, text while it runs, text at its end)
MOTIONS: dict[str, tuple[str, str, str]] = {
    "MOVE": (Mode.OPERATOR_LEADS, "both robots move", "target reached, both stand still"),
    "MOVE_JOINTS": (Mode.OPERATOR_LEADS, "both robots move", "target reached, both stand still"),
    "HOME": (Mode.OPERATOR_LEADS, "both robots move", "home reached, both stand still"),
    "ALIGN": (Mode.ALIGNING, "the twin goes slowly to the real robot", "both agree, ready"),
    "RUN": (Mode.REAL_LEADS, "the real robot runs it, the twin follows", "ended, both stand still"),
}
SILENT = "the twin controller is silent: look at the robots to see what became of it"


class Command(msgspec.Struct, frozen=True):
    """One command as the page shows it.

    Attributes:
        number: Counts up.
        kind: The command, as the twin controller names it, or a name of the page's own.
        clock: Time of day at which it was sent.
        who: Who sent it.
        title: What was asked for.
        outcome: Where it is.
        text: The reason, or what happens now.
        tone: Colour.
        changed: Monotonic time of the last change [s].
        began: Its motion was seen.
    """

    number: int
    kind: str
    clock: str
    who: str
    title: str
    outcome: Fate = Fate.SENT
    text: str = "waiting for the answer"
    tone: str = "busy"
    changed: float = 0.0
    began: bool = False

    @property
    def ended(self) -> bool:
        """Whether nothing more will come of it."""
        return self.outcome in ENDED


class CommandLog:
    """Follows commands to their end. Not thread-safe: it lives in the page's event loop."""

    def __init__(self) -> None:
        """Know of no command yet."""
        self._commands: dict[int, Command] = {}
        self._count = 0
        self._ended: deque[Command] = deque()

    def begin(self, kind: str, title: str, who: str, clock: str, now: float) -> int:
        """Note a command that is sent now; return its number."""
        self._count += 1
        made = Command(self._count, kind, clock, who, title, changed=now)
        self._commands[made.number] = made
        while len(self._commands) > KEPT:
            del self._commands[min(self._commands)]
        return made.number

    def find(self, number: int) -> Command | None:
        """Return a command by its number; None: too many have come since."""
        return self._commands.get(number)

    def answered(self, number: int, answer: Answer, now: float) -> None:
        """Take the answer to a command; a motion goes on from here."""
        command = self._commands.get(number)
        if command is None or command.ended:
            return
        text = page_words.people(answer.message)
        if answer.lost:
            self._change(command, Fate.LOST, text, now)
        elif not answer.success:
            self._change(command, Fate.REFUSED, text, now)
        elif command.kind in MOTIONS:
            self._change(command, Fate.RUNNING, MOTIONS[command.kind][1], now)
        elif command.kind in ("STOP", "ESTOP", "STANDSTILL", "PAUSE", "RESUME", "RESET"):
            self._change(command, Fate.RUNNING, text, now)
        else:
            self._change(command, Fate.DONE, text or "done", now)

    def look(self, snapshot: Snapshot, silent: bool, now: float) -> None:
        """Bring the commands that have not ended up to date."""
        for command in list(self._commands.values()):
            if command.ended or command.outcome is Fate.SENT:
                continue
            if silent or snapshot.state is None:
                self._change(command, Fate.LOST, SILENT, now)
                continue
            outcome, text = _judged(command, snapshot, snapshot.state, now)
            began = command.began or (
                command.kind in MOTIONS and snapshot.state.mode == MOTIONS[command.kind][0]
            )
            self._change(command, outcome, text, now, began)

    @property
    def shown(self) -> tuple[Command, ...]:
        """The newest first, then what still runs; no more than the page has places for.

        A narrow page has room for the first one only.
        """
        found = sorted(self._commands.values(), key=lambda c: (-c.changed, -c.number))
        rest = sorted(found[1:], key=lambda c: c.ended)
        return tuple([*found[:1], *rest][:SHOWN])

    def take_ended(self) -> list[Command]:
        """Return the commands that have ended since the last call."""
        ended = list(self._ended)
        self._ended.clear()
        return ended

    def _change(
        self, command: Command, outcome: Fate, text: str, now: float, began: bool = False
    ) -> None:
        same = (outcome, text) == (command.outcome, command.text)
        tone = TONES[outcome]
        if tone == "good" and command.kind in NEVER_GREEN:
            tone = "warn"
        changed = msgspec.structs.replace(
            command,
            outcome=outcome,
            text=text,
            tone=tone,
            began=began or command.began,
            # A change of words alone does not bring it to the front again.
            changed=command.changed if outcome == command.outcome else now,
        )
        self._commands[command.number] = changed
        if changed.ended and not same:
            self._ended.append(changed)


def _judged(command: Command, snapshot: Snapshot, state: CellState, now: float) -> tuple[Fate, str]:
    """Return where an accepted command is, by what the twin controller says."""
    if command.kind in MOTIONS:
        return _motion(command, snapshot, state, now)
    waited = now - command.changed
    still = state.real_standing_still and state.twin_standing_still
    match command.kind:
        case "PAUSE":
            if state.mode == Mode.PAUSED and still:
                return Fate.DONE, "both are held; Resume goes on, Stop ends the motion"
            if waited > GRACE_S and state.mode != Mode.PAUSED:
                return Fate.DONE, page_words.people(state.why)
        case "RESUME":
            if state.mode == Mode.OFFLINE:
                return Fate.LOST, page_words.people(state.why)
            if state.mode in HALTED:
                return Fate.STOPPED, page_words.people(state.why)
            if state.mode == Mode.IDLE:
                # Its end has come already, or nothing was left of it: the controller says which.
                return Fate.DONE, page_words.people(state.why)
            if state.mode != Mode.PAUSED:
                return Fate.DONE, "the motion goes on"
            if waited > GRACE_S:
                return Fate.REFUSED, page_words.people(state.why)
        case "RESET":
            if state.mode not in (Mode.ESTOP, Mode.FAULT, Mode.STANDSTILL):
                return Fate.DONE, "nothing moves; Align goes on"
            if waited > RESET_S:
                return Fate.REFUSED, page_words.people(state.why)
        case "STOP" | "ESTOP" | "STANDSTILL":
            if still:
                return Fate.DONE, "both stand still"
    return Fate.RUNNING, command.text


def _motion(command: Command, snapshot: Snapshot, state: CellState, now: float) -> tuple[Fate, str]:
    busy, moving, reached = MOTIONS[command.kind]
    package = snapshot.package
    runs = command.kind == "RUN" and package is not None and package.running
    if state.mode == busy or (runs and state.mode == Mode.IDLE):
        program = package.program if runs and package is not None else ""
        return Fate.RUNNING, f"{program}, the twin follows" if program else moving
    if state.mode == Mode.PAUSED:
        return Fate.PAUSED, page_words.people(state.why)
    grace = PROGRAM_GRACE_S if command.kind == "RUN" else GRACE_S
    if not command.began and now - command.changed < grace:
        return Fate.RUNNING, moving  # the mode that begins it has not come yet
    if state.mode == Mode.IDLE:
        if state.move_failed and command.kind in ("MOVE", "MOVE_JOINTS", "HOME"):
            return Fate.STOPPED, f"target not reached: {page_words.people(state.move_failed)}"
        return Fate.DONE, reached
    if state.mode == Mode.OFFLINE:
        return Fate.LOST, page_words.people(state.why)
    return Fate.STOPPED, page_words.people(state.why)
