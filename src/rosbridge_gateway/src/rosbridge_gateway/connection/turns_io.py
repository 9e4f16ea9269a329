"""The packets of one client that wait for their turn."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any

from rosbridge_gateway.protocol.packets import Packet

_MOST = 256  # our choice: so many wait at most; then nothing more of this client is read

Perform = Callable[[Packet, float], Coroutine[Any, Any, None]]


class Turns:
    """Performs packets one after the other, in the event loop's thread.

    A packet may take a while (a subscription, a call that has not begun yet); its client is read
    on meanwhile, so that a stop among what comes is seen at once.
    """

    def __init__(self, perform: Perform) -> None:
        """Take what performs a packet that came at a time (monotonic, [s])."""
        self._perform = perform
        self._waiting: deque[tuple[Packet, float] | asyncio.Task[None]] = deque()
        self._room = asyncio.Semaphore(_MOST)
        self._task: asyncio.Task[None] | None = None

    @property
    def is_free(self) -> bool:
        """Whether nothing waits, and nothing is being performed."""
        return self._task is None

    async def put(self, packet: Packet, came: float) -> None:
        """Let a packet wait for its turn; wait oneself while too many do."""
        await self._room.acquire()
        self._add((packet, came))

    def overtake(self, perform: Coroutine[Any, Any, None]) -> None:
        """Perform something now, beside what waits; what comes later waits for it."""
        self._add(asyncio.create_task(perform))

    async def finish(self) -> None:
        """Wait until all has been performed."""
        while self._task is not None:
            await asyncio.wait([self._task])

    def forget(self) -> None:
        """Perform nothing of what still waits."""
        for turn in self._waiting:
            if isinstance(turn, tuple):
                self._room.release()
        self._waiting = deque(turn for turn in self._waiting if not isinstance(turn, tuple))

    def _add(self, turn: tuple[Packet, float] | asyncio.Task[None]) -> None:
        self._waiting.append(turn)
        if self._task is None:
            self._task = asyncio.create_task(self._run())

    async def _run(self) -> None:
        try:
            while self._waiting:
                turn = self._waiting.popleft()
                if isinstance(turn, tuple):
                    self._room.release()
                    await self._perform(*turn)
                else:
                    await turn
        finally:
            self._task = None
