"""What the bus brings, in batches: a ring that the bus fills, and a thread that empties it.

One callback for each message would take the interpreter 5,000 times a second from who computes, and
wait for it as often. The ring is filled without the interpreter. Where it is full the oldest goes.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Sequence
from typing import Any

import zenoh

CAPACITY = 20_000
"""Our choice: four seconds of 1,000 cells at 5 Hz; some 10 MB."""
MOST = 2000
"""Our choice: messages of one batch; others get their turn after it."""
PACE_S = 0.001
"""Our choice: after a batch the ring fills for so long. To wake for each message costs more than to
read it, and nobody who looks sees a millisecond."""


class Mailbox:
    """Hands on what comes under a key expression, in batches and in order; a context manager."""

    def __init__(
        self,
        session: zenoh.Session,
        expression: str,
        take: Callable[[Sequence[zenoh.Sample]], None],
    ) -> None:
        """Subscribe and begin.

        Args:
            session: An open session; the mailbox leaves it open.
            expression: Of the keys.
            take: Gets each batch, in the mailbox's own thread.
        """
        self._take = take
        self._subscriber: Any = session.declare_subscriber(
            expression, zenoh.handlers.RingChannel(CAPACITY)
        )
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._hand_on, name=expression, daemon=True)
        self._thread.start()

    def __enter__(self) -> Mailbox:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Unsubscribe. What was not handed on yet is gone: the numbers of events tell."""
        self._closed.set()
        with contextlib.suppress(zenoh.ZError):  # the session may be gone
            self._subscriber.undeclare()
        self._thread.join()

    def _hand_on(self) -> None:
        ring = self._subscriber.handler
        batch: list[zenoh.Sample] = []
        subscribed = True
        while subscribed:
            try:
                batch.append(ring.recv())
                while len(batch) < MOST and (sample := ring.try_recv()) is not None:
                    batch.append(sample)
            except zenoh.ZError:  # unsubscribed
                subscribed = False
            if batch:
                self._take(batch)
                batch = []
                self._closed.wait(PACE_S)
