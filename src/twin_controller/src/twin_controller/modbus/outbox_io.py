"""What is to be written to the robot.

It holds the newest set point, signals and numbers in their order, and pulses to be ended.
"""

from __future__ import annotations

import dataclasses
import threading
import time
from collections import deque
from collections.abc import Sequence

import msgspec

from twin_controller.core.actions import StreamAhead, StreamReal

# A controller takes these two at the end of the pulse, the falling edge.
_ACT_ON_RELEASE = ("fault_reset", "start")


@dataclasses.dataclass(frozen=True, slots=True)
class Command:
    """One signal or integer register to be written.

    Attributes:
        pulsed: On now, off later.
        behind: Not before a set point that was left before it.
    """

    name: str
    value: int | bool
    pulsed: bool
    behind: bool = False


class Outbox:
    """Mailbox between the owner's threads and the link's thread."""

    def __init__(self) -> None:
        self.closed = False
        # Set points were dropped since the last take: those that it gave no longer count.
        self.dropped = False
        self._changed = threading.Condition()
        self._setpoints: deque[StreamReal] = deque()
        self._ahead: StreamAhead | None = None
        self._commands: deque[Command] = deque()
        # When each pulsed signal goes off again.
        self._releases: dict[str, float] = {}

    def put_setpoint(self, action: StreamReal) -> None:
        """Leave a set point until its time; it replaces those left for then or later."""
        with self._changed:
            while self._setpoints and self._setpoints[-1].send_at >= action.send_at:
                self._setpoints.pop()
            self._setpoints.append(action)
            self._changed.notify()

    def put_ahead(self, ahead: StreamAhead) -> None:
        """Leave set points ahead of their time, to be written at once, with those that wait."""
        with self._changed:
            self._ahead = _together(self._ahead, ahead)
            self._changed.notify()

    def drop_setpoints(self) -> None:
        """Forget the set points that wait, and what waits for them: the robot is to stop."""
        with self._changed:
            self._setpoints.clear()
            self._ahead = None
            self._commands = deque(command for command in self._commands if not command.behind)
            self.dropped = True

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
        """Remember to switch a pulsed signal off at ``due`` (reader only).

        One that is on already stays on until then.
        """
        self._releases[name] = due

    def due_releases(self) -> list[str]:
        """Return the pulsed signals whose time is over (reader only)."""
        now = time.monotonic()
        return [name for name, due in self._releases.items() if due <= now]

    def pulse_ended(self, name: str) -> None:
        """Note that a pulsed signal was switched off (reader only)."""
        del self._releases[name]

    def take(self, until: float) -> tuple[StreamReal | None, StreamAhead | None, list[Command]]:
        """Wait for something to write, the end of a pulse, ``until``, or the end of the box.

        A set point is taken when it is due. It is taken sooner only for a command that must not
        come before it.
        """
        until = min(until, *self._releases.values()) if self._releases else until
        with self._changed:
            while not (self._commands or self._ahead is not None):
                if self.closed and not self._releases:
                    break
                wake = min(until, self._setpoints[0].send_at) if self._setpoints else until
                if (left := wake - time.monotonic()) <= 0.0:
                    break
                self._changed.wait(left)
            now, setpoint = time.monotonic(), None
            while self._setpoints and self._setpoints[0].send_at <= now:
                setpoint = self._setpoints.popleft()
            if (
                setpoint is None
                and self._setpoints
                and any(command.behind for command in self._commands)
            ):
                setpoint = self._setpoints.popleft()
            commands = list(self._commands)
            self._commands.clear()
            ahead, self._ahead = self._ahead, None
            self.dropped = False
            return setpoint, ahead, commands

    def take_between(self) -> list[Command]:
        """Take what must not wait for set points ahead that are being written (reader only).

        Returns:
            Commands up to one that waits for them.
        """
        with self._changed:
            commands = []
            while self._commands and not self._commands[0].behind:
                commands.append(self._commands.popleft())
            return commands

    def put_back(
        self, setpoint: StreamReal | None, ahead: StreamAhead | None, commands: Sequence[Command]
    ) -> None:
        """Give back what was taken and is not confirmed, before all that waits (reader only).

        One that a newer set point has replaced, or that was dropped meanwhile, is forgotten.
        """
        with self._changed:
            newer = self._setpoints and setpoint and self._setpoints[0].send_at <= setpoint.send_at
            if setpoint is not None and not (self.dropped or newer):
                self._setpoints.appendleft(setpoint)
            if ahead is not None and not self.dropped:
                self._ahead = _together(ahead, self._ahead)
            kept = [command for command in commands if not (command.behind and self.dropped)]
            self._commands.extendleft(reversed(kept))

    @property
    def beats_soon(self) -> bool:
        """A set point is due, which carries a heartbeat."""
        with self._changed:
            setpoints, now = self._setpoints, time.monotonic()
            return self._ahead is not None or bool(setpoints and setpoints[0].send_at <= now)

    @property
    def left(self) -> list[str]:
        """Names of the commands that wait."""
        with self._changed:
            return [command.name for command in self._commands]

    @property
    def unfinished(self) -> bool:
        """Commands wait, or ends of pulses."""
        return bool(self._commands or self._releases)

    def pause(self, until: float) -> None:
        """Wait until ``until``, or until the box is closed."""
        with self._changed:
            while not self.closed and (left := until - time.monotonic()) > 0.0:
                self._changed.wait(left)

    def discard(self) -> int:
        """Forget everything and return how many writes that were.

        Nothing is replayed after a reconnect. A pulse that was on is still ended, unless its end is
        what acts.
        """
        with self._changed:
            lost = len(self._commands) + len(self._setpoints)
            lost += len(self._ahead.points) if self._ahead is not None else 0
            self._commands.clear()
            self._setpoints.clear()
            self._ahead = None
            for name in _ACT_ON_RELEASE:
                self._releases.pop(name, None)
            return lost


def _together(older: StreamAhead | None, newer: StreamAhead | None) -> StreamAhead | None:
    """Return the set points of both; of one number the newer."""
    if older is None or newer is None:
        return newer or older
    again = {point.number for point in newer.points}
    kept = [point for point in older.points if point.number not in again]
    return msgspec.structs.replace(newer, points=(*kept, *newer.points))
