"""Loops and listeners of a node that has nothing to do: they wait, and go on at once when it has.

The measured joints come 100 times a second, and a loop of 100 Hz wakes as often. A wake costs more
than what is done in it, so a node without a goal does both seldom. It stays subscribed: a goal
needs no master, and no new connection.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

IDLE_S = 0.05
"""Period of a loop at rest; our choice: as often as the twin controller says its state."""

QUIET_S = 0.1
"""The same of a node that says nothing while it rests; our choice."""

HOLD_S = 0.2
"""Measured joints that nobody needs are read so often; our choice: less than half of the
``state_timeout`` of motion.yaml, which they must not outlive."""

STATE_HOLD_S = 1.0
"""The states of other nodes that nobody needs are read so often; our choice."""

ATTENTION_S = 0.5
"""So long after a motion may have begun all measured joints are read; our choice: the slowest jog
is measured by then."""

CATCH_UP_S = 0.02
"""A request waits so long for the newest message; our choice: twice the period of the measured
joints. What comes more seldom waits in the socket by then, or is no older than its period."""


class IdleWait:
    """Waits while there is nothing to do. Safe to use from several threads."""

    def __init__(self, is_idle: Callable[[], bool]) -> None:
        """Remember who knows whether there is something to do."""
        self._is_idle = is_idle
        self._woken = threading.Event()

    def wake(self) -> None:
        """End the waiting, once there is something to do."""
        self._woken.set()

    def wait(self, longest: float) -> bool:
        """Wait until woken, ``longest`` [s] at most; return whether there was a wait at all."""
        # Cleared first: who wakes us from here on has changed what is_idle is going to see.
        self._woken.clear()
        if not self._is_idle():
            return False
        self._woken.wait(longest)
        return True


class Attention:
    """How closely a listener looks at what comes all the time.

    To be asked after each message, in the thread that reads. While it waits, the messages stay in
    the socket; rospy then throws all but the newest away unread, so what is read next is fresh.
    That needs a subscription with a queue of 1.
    """

    def __init__(
        self,
        is_idle: Callable[[], bool],
        longest: float = STATE_HOLD_S,
        standstill: Sequence[float] = (),
    ) -> None:
        """Look at each message at first.

        Args:
            is_idle: Whether the node has nothing to do.
            longest: A message that nobody needs is held so long before the next [s].
            standstill: For measured joints: below these speeds they rest [rad/s] or [m/s].
        """
        self._standstill = tuple(standstill)
        self._is_idle, self._longest = is_idle, longest
        self._until = time.monotonic() + ATTENTION_S
        self._wait = IdleWait(self._may_wait)
        self._holds = False
        self._read = threading.Event()

    def rouse(self) -> None:
        """Look at each message for a while: a motion begins, or may begin elsewhere."""
        self._until = time.monotonic() + ATTENTION_S
        self._wait.wake()

    def catch_up(self) -> None:
        """Look at each message from now on, and wait for the newest if we have not been looking."""
        # Noted before rouse() ends it; cleared before, too, so what follows is not missed.
        held = self._holds
        self._read.clear()
        self.rouse()
        if held:
            self._read.wait(CATCH_UP_S)

    def hold(self, velocities: Sequence[float] = ()) -> None:
        """Wait before the next message if nobody needs it.

        Args:
            velocities: For measured joints: what was just read, in the order of ``standstill``;
                joints that move are never read late.
        """
        self._read.set()
        if all(abs(v) <= slow for v, slow in zip(velocities, self._standstill)):
            self._holds = True
            self._wait.wait(self._longest)
            self._holds = False

    def _may_wait(self) -> bool:
        return time.monotonic() >= self._until and self._is_idle()
