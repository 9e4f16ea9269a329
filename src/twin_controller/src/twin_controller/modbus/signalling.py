"""How signals reach the robot: by coils, or as numbered commands that it confirms one by one.

A signal is named as in modbus_map.yaml, set to a level or pulsed. The map says which of the two it
becomes.
"""

from __future__ import annotations

from collections import deque

import msgspec
from scara_config.modbus_map import CommandWord, ModbusMap

from twin_controller.core.orders.order import GiveUp, Order, Patience, due

SEQUENCES = 32768


class NumberedCommand(msgspec.Struct, frozen=True):
    """A command that the robot confirms by its number.

    Attributes:
        name: Of the signal, for messages.
        code: As the map says.
        sequence: Its number.
        start: It starts what waits for a set point.
    """

    name: str
    code: int
    sequence: int
    start: bool


class CommandQueue:
    """Numbered commands: one at a time, each repeated until its number comes back.

    Repeating is safe: a command counts only when its number changes.

    Args:
        word: Of modbus_map.yaml.
        patience: How long the robot may take to confirm one, see :func:`patience`.
    """

    def __init__(self, word: CommandWord, patience: Patience) -> None:
        self._word, self._patience = word, patience
        self._echo: int | None = None  # the robot's number; unknown until the first sample
        self._given: int | None = None  # the number of the newest command
        self._waiting: deque[tuple[str, int, bool]] = deque()  # name, code, whether it is a start
        self._pending: Order[NumberedCommand] | None = None

    def put(self, name: str, level: bool, pulsed: bool, behind: bool = False) -> None:
        """Queue the command that sets or pulses a signal, one that takes a signal away first.

        The end of a pulse is no command.

        Args:
            name: Of the signal.
            level: Where it goes.
            pulsed: And back.
            behind: It starts what waits for a set point.
        """
        codes = self._word.codes[name]
        if pulsed:
            code = codes.pulse
        elif codes.pulse is None:
            code = codes.high if level else codes.low
        else:
            code = codes.pulse if level else None
        if code is None:
            return
        if level:
            # Once more while it waits is once, and last: a stop that is told again stays behind it.
            self._waiting = deque(each for each in self._waiting if each[:2] != (name, code))
            self._waiting.append((name, code, behind))
            return
        # What stops the robot waits for nothing. What it overtakes is older: a start has lost its
        # set point, and what gives the same signal back would undo the stop.
        under_way = None if self._pending is None else self._pending.wanted
        stays = under_way is not None and under_way.code == code
        if under_way is not None and not stays:
            # It goes once more: the robot may not have taken it.
            self._waiting.appendleft((under_way.name, under_way.code, under_way.start))
            self._pending = None
        self._waiting = deque(each for each in self._waiting if each[0] != name and not each[2])
        if not stays:
            self._waiting.appendleft((name, code, False))

    def confirm(self, echo: int) -> None:
        """Take the number that the robot shows."""
        self._echo = echo
        if self._pending is not None and is_shown(self._pending.wanted, echo):
            self._pending = None

    def next(self, now: float) -> NumberedCommand | None:
        """Return the command to be written now, if there is one.

        Nothing is written before the robot's number is known.

        Raises:
            CommandLostError: The robot did not confirm one in spite of all attempts. The next one
                has its turn then.
        """
        if self._echo is None:
            return None
        if self._pending is None and self._waiting:
            name, code, start = self._waiting.popleft()
            # Not behind what it shows: it may have taken one that was overtaken or given up.
            number = following(self._echo if self._given is None else self._given)
            self._given = following(number) if number == self._echo else number
            command = NumberedCommand(name, code, self._given, start)
            self._pending = Order(command, self._patience)
        late = due([self._pending], now)
        if late.failures:
            lost, self._pending = late.failures[0], None
            command = lost.wanted
            raise CommandLostError(
                f"{command.name}: the robot did not confirm command {command.code}"
                f" in {lost.attempts} attempts"
            )
        if not late.sends:
            return None
        self._pending = late.sends[0]
        return self._pending.wanted

    def due(self) -> float | None:
        """Return when something is to be written [s], None if nothing is."""
        if self._echo is None or (self._pending is None and not self._waiting):
            return None
        return self._pending.due_at if self._pending is not None else 0.0

    @property
    def left(self) -> list[str]:
        """Names of those that the robot has not confirmed; any thread may ask."""
        pending = self._pending
        first = [pending.wanted.name] if pending is not None else []
        return [*first, *(name for name, _, _ in tuple(self._waiting))]

    def discard(self) -> int:
        """Forget everything, as after a reconnect; return how many commands that were."""
        lost = len(self._waiting) + (self._pending is not None)
        self._waiting.clear()
        self._pending, self._echo = None, None
        return lost


def is_shown(command: NumberedCommand, echo: int) -> bool:
    """Return whether the robot shows the number of this command."""
    return command.sequence == echo


def patience(retry: float, attempts: int) -> Patience:
    """Return how long a robot may take to confirm: ``attempts`` writes, ``retry`` [s] apart."""
    return Patience(retry, attempts, GiveUp.SAY_SO)


def following(echo: int) -> int:
    """Return the next odd number after ``echo``.

    Even ones are the pendant's, so that the two never choose the same.
    """
    return (echo + 1 + echo % 2) % SEQUENCES


class CommandLostError(RuntimeError):
    """The robot did not take a command."""


def signal_names(layout: ModbusMap) -> frozenset[str]:
    """Return the names of all inputs of the robot that the map describes."""
    return frozenset(layout.command_word.codes if layout.command_word else layout.coils)


def may_write_signal(layout: ModbusMap, name: str) -> bool:
    """Return whether the twin controller may change this input: a marked coil, or any command."""
    return layout.command_word is not None or layout.coils[name].write
