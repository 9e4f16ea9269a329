"""Service calls on their way over a rosbridge link: each gets exactly one answer."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

OnAnswer = Callable[[bool, Any, float, float], None]
Answer = tuple[OnAnswer, bool, Any, float, float]


@dataclass(frozen=True, slots=True)
class _Call:
    callback: OnAnswer
    service: str
    sent: float
    deadline: float


class PendingCalls:
    """Calls that wait for their answer; safe for several threads.

    What is to be told comes back as (callback, result, values, received, sent), so that no callback
    runs under the lock.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._calls: dict[str, _Call] = {}

    def add(self, service: str, callback: OnAnswer, timeout: float) -> str:
        """Note a call that is about to be sent; return its id."""
        now = time.monotonic()
        call_id = f"{service}:{next(self._numbers)}"
        with self._lock:
            self._calls[call_id] = _Call(callback, service, now, now + timeout)
        return call_id

    def withdraw(self, call_id: str) -> bool:
        """Forget a call that could not be sent; False when it has been answered meanwhile."""
        with self._lock:
            return self._calls.pop(call_id, None) is not None

    def answered(self, call_id: Any, result: bool, values: Any, received: float) -> Answer | None:
        """Return what to tell the caller, or None when nobody waits for ``call_id``."""
        with self._lock:
            call = self._calls.pop(call_id, None) if isinstance(call_id, str) else None
        return None if call is None else (call.callback, result, values, received, call.sent)

    def expired(self, now: float) -> list[Answer]:
        """Return the failed answers of all calls whose time is up at ``now``."""
        # Without the lock: this is asked behind each packet, and mostly no call is open.
        if not self._calls:
            return []
        return self._end("no answer in time, it may still go on", now)

    def abandon(self, reason: str) -> list[Answer]:
        """Return failed answers for all calls."""
        return self._end(reason, float("inf"))

    def _end(self, reason: str, until: float) -> list[Answer]:
        now = time.monotonic()
        with self._lock:
            ended = [
                self._calls.pop(call_id)
                for call_id, call in list(self._calls.items())
                if call.deadline <= until
            ]
        return [
            (call.callback, False, f"{call.service}: {reason}", now, call.sent) for call in ended
        ]
