"""The background program that watches the client's heartbeat.

Modbus itself keeps the last value of a dead client for ever.
"""

from __future__ import annotations

from enum import IntEnum


class WatchdogState(IntEnum):
    """What the register ``watchdog_state`` says."""

    DISARMED = 0
    ARMED = 1
    EXPIRED = 2


class Watchdog:
    """Expire when an armed heartbeat stands still.

    The first change to a value other than 0 arms it; writing 0 disarms it; expired stays expired
    until :meth:`reset`.

    Args:
        timeout_ms: Longest time without a change.
    """

    def __init__(self, timeout_ms: int) -> None:
        self._timeout_ms = timeout_ms
        self._changed_ms = 0
        self.heartbeat = 0
        self.state = WatchdogState.DISARMED

    def beat(self, heartbeat: int, now_ms: int) -> None:
        """Take the heartbeat register's new value."""
        changed = heartbeat != self.heartbeat
        self.heartbeat = heartbeat
        if self.state is WatchdogState.EXPIRED:
            return
        if heartbeat == 0:
            self.state = WatchdogState.DISARMED
        elif changed:
            self.state = WatchdogState.ARMED
            self._changed_ms = now_ms

    def expires(self, now_ms: int) -> bool:
        """Return True once, at the moment it expires."""
        if self.state is not WatchdogState.ARMED or now_ms - self._changed_ms <= self._timeout_ms:
            return False
        self.state = WatchdogState.EXPIRED
        return True

    def reset(self) -> None:
        """Leave EXPIRED: disarmed until the heartbeat changes again."""
        if self.state is WatchdogState.EXPIRED:
            self.state = WatchdogState.DISARMED
