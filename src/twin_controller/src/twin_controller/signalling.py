"""How signals reach the robot: by coils, or as numbered commands that the robot confirms one by one.

A signal is named as in modbus_map.yaml, set to a level or pulsed; which of the two it becomes is the map's affair.
"""

from __future__ import annotations

from collections import deque

import msgspec
from scara_config.modbus_map import CommandWord, ModbusMap

SEQUENCES = 32768


class Pending(msgspec.Struct, frozen=True):
    """A numbered command that the robot has not confirmed yet.

    Attributes:
        name: Of the signal, for messages.
        code: As the map says.
        sequence: Its number.
        due: When it is written again [s].
        attempts: How often it was written.
    """

    name: str
    code: int
    sequence: int
    due: float
    attempts: int


class CommandQueue:
    """Numbered commands: one at a time, each repeated until its number comes back.

    Repeating is safe: a command counts only when its number changes.

    Args:
        word: Of modbus_map.yaml.
        patience: Time until a command is written again [s].
        attempts: So many times at most.
    """

    def __init__(self, word: CommandWord, patience: float = 0.1, attempts: int = 5) -> None:
        self._word = word
        self._patience, self._attempts = patience, attempts
        self._echo: int | None = None
        self._waiting: deque[tuple[str, int]] = deque()
        self._pending: Pending | None = None

    def put(self, name: str, level: bool, pulsed: bool) -> None:
        """Queue the command that sets or pulses a signal; one that only ends a pulse is none."""
        codes = self._word.codes[name]
        code = codes.pulse if pulsed or codes.pulse is not None else codes.high if level else codes.low
        if code is not None and (pulsed or level or codes.pulse is None):
            self._waiting.append((name, code))

    def confirm(self, echo: int) -> None:
        """Take the number that the robot shows."""
        self._echo = echo
        if self._pending is not None and self._pending.sequence == echo:
            self._pending = None

    def next(self, now: float) -> Pending | None:
        """Return the command to be written now, None if there is none; nothing is written before the robot's number is known.

        Raises:
            CommandLostError: The robot did not confirm one in spite of all attempts; the next one has its turn then.
        """
        if self._echo is None:
            return None
        if self._pending is None and self._waiting:
            name, code = self._waiting.popleft()
            self._pending = Pending(name, code, following(self._echo), now, 0)
        if self._pending is None or now < self._pending.due:
            return None
        if self._pending.attempts >= self._attempts:
            lost, self._pending = self._pending, None
            raise CommandLostError(f"{lost.name}: the robot did not confirm command {lost.code} in {lost.attempts} attempts")
        changes = {"due": now + self._patience, "attempts": self._pending.attempts + 1}
        self._pending = msgspec.structs.replace(self._pending, **changes)
        return self._pending

    def due(self) -> float | None:
        """Return when something is to be written [s], None if nothing is."""
        if self._echo is None or (self._pending is None and not self._waiting):
            return None
        return self._pending.due if self._pending is not None else 0.0

    def discard(self) -> int:
        """Forget everything, as after a reconnect; return how many commands that were."""
        lost = len(self._waiting) + (self._pending is not None)
        self._waiting.clear()
        self._pending, self._echo = None, None
        return lost


def following(echo: int) -> int:
    """Return the next odd number after ``echo``: even ones are the pendant's, so that the two never choose the same."""
    return (echo + 1 + echo % 2) % SEQUENCES


class CommandLostError(RuntimeError):
    """The robot did not take a command."""


def signal_names(layout: ModbusMap) -> frozenset[str]:
    """Return the names of all inputs of the robot that the map describes."""
    return frozenset(layout.command_word.codes if layout.command_word else layout.coils)


def may_write_signal(layout: ModbusMap, name: str) -> bool:
    """Return whether the twin controller may change this input: a coil marked so, or any command."""
    return layout.command_word is not None or layout.coils[name].write
