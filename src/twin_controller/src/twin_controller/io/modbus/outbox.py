"""What is to be written to the robot: the newest set point, signals and numbers in their order, pulses to be ended."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections import deque

Setpoint = tuple[tuple[float, ...], float]

_ACT_ON_RELEASE = ("fault_reset", "start")


@dataclasses.dataclass(frozen=True, slots=True)
class Command:
    """One signal or integer register to be written; ``pulsed``: on now, off later."""

    name: str
    value: int | bool
    pulsed: bool


class Outbox:
    """Mailbox between the owner's threads and the link's thread."""

    def __init__(self) -> None:
        self.closed = False
        self.overwritten = 0
        self._changed = threading.Condition()
        self._setpoint: Setpoint | None = None
        self._commands: deque[Command] = deque()
        self._releases: deque[tuple[float, str]] = deque()

    def put_setpoint(self, setpoint: Setpoint) -> None:
        """Leave a set point; the latest wins."""
        with self._changed:
            self.overwritten += self._setpoint is not None
            self._setpoint = setpoint
            self._changed.notify()

    def put(self, command: Command) -> None:
        """Leave a command; all are kept."""
        with self._changed:
            self._commands.append(command)
            self._changed.notify()

    def close(self) -> None:
        """Wake the reader for the last time."""
        with self._changed:
            self.closed = True
            self._changed.notify()

    def end_pulse(self, name: str, due: float) -> None:
        """Remember to switch a pulsed signal off at ``due`` (reader only)."""
        self._releases.append((due, name))

    def due_releases(self) -> list[str]:
        """Take the pulsed signals whose time is over (reader only)."""
        names = []
        while self._releases and self._releases[0][0] <= time.monotonic():
            names.append(self._releases.popleft()[1])
        return names

    def take(self, until: float) -> tuple[Setpoint | None, list[Command]]:
        """Wait until there is something to write, a pulse ends, ``until`` is reached or the box is closed."""
        if self._releases:
            until = min(until, self._releases[0][0])
        with self._changed:
            while not (self.closed or self._setpoint or self._commands) and (left := until - time.monotonic()) > 0.0:
                self._changed.wait(left)
            setpoint, self._setpoint = self._setpoint, None
            commands = list(self._commands)
            self._commands.clear()
            return setpoint, commands

    def pause(self, until: float) -> None:
        """Wait until ``until``, or until the box is closed."""
        with self._changed:
            while not self.closed and (left := until - time.monotonic()) > 0.0:
                self._changed.wait(left)

    def discard(self) -> int:
        """Forget everything and return how many writes that were: nothing is replayed after a reconnect.

        A pulse that was on is still ended, unless its end is what acts.
        """
        with self._changed:
            lost = len(self._commands) + (self._setpoint is not None)
            self._commands.clear()
            self._setpoint = None
            self._releases = deque((due, name) for due, name in self._releases if name not in _ACT_ON_RELEASE)
            return lost
