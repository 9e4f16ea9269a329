"""Programs that the robot starts by itself are judged and told; a REFUSED one may be held."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

import rospy
from scara_ros.gate.permit import Permit

from twin_controller.core.events import RealMeasured


class Gate(Protocol):
    """What asks the judge."""

    def ask(self, what: str, who: str = "", **request: str) -> Permit:
        """Return whether a motion may begin."""


class OwnPrograms:
    """Looks for programs that begin, and has each judged once, in a thread of its own.

    Such a program cannot be refused: it runs already when anybody hears of it. The judgement is
    shown and kept like every other one.

    Args:
        gate: Asks the judge, with the patience of a program.
        hold: Whether the pair is paused if a program is refused (``hold_own_programs``).
        flags: Returns what the robot says of itself now; None: nothing yet.
        pause: Pauses the pair.
    """

    def __init__(
        self,
        gate: Gate,
        hold: bool,
        flags: Callable[[], RealMeasured | None],
        pause: Callable[[], None],
    ) -> None:
        self._gate, self._hold, self._flags, self._pause = gate, hold, flags, pause
        self._known = ""

    def look(self) -> threading.Thread | None:
        """Look whether a program has begun; return the thread that judges it.

        A link that was lost says nothing of programs: one that runs on behind it has not begun,
        and what the operator has resumed is not held again.
        """
        flags = self._flags()
        if flags is None:
            return None
        running = _running(flags)
        begun = bool(running) and running != self._known
        self._known = running
        if not begun:
            return None
        thread = threading.Thread(target=self.judge, args=(running,), name="judge", daemon=True)
        thread.start()
        return thread

    def judge(self, program: str) -> None:
        """Judge a program; hold the robot if it is refused, still runs, and that is wanted."""
        what = f"the robot's own program {program}"
        found = self._gate.ask(what, who="the robot", motion="PROGRAM", program=program)
        if not found.allowed and self._hold and _running(self._flags()) == program:
            rospy.logwarn("%s is held (hold_own_programs)", what)
            self._pause()


def _running(flags: RealMeasured | None) -> str:
    """Return the name of the program that runs; empty: none, or one without a name."""
    return flags.program if flags is not None and flags.own_program else ""
