"""What waits for one client: answers in order, and per topic only the newest messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

Item = TypeVar("Item")

_EARLY_PART = 0.2
_LATE_PART = 0.3


@dataclass(slots=True)
class _Topic(Generic[Item]):
    """The waiting messages of one subscription, ``most`` of them.

    ``sent`` is when the last message went out, ``turn`` when the next one is due by the throttle
    rate, ``due`` when the oldest waiting one may go out.
    """

    interval: float
    most: int
    waiting: deque[Item]
    sent: float = float("-inf")
    turn: float = float("-inf")
    due: float = float("-inf")


class Outbox(Generic[Item]):
    """Packets that a client has not taken yet, bounded whatever the client does.

    Each topic keeps its newest ``queue_length`` messages (at least one), fewer where those of all
    topics come to too many bytes; answers are kept in order up to a number.

    A throttled topic sends a message the moment it comes when its turn is near, and keeps an early
    one a little beyond the turn, because a newer one may come just then: otherwise a source at
    200 Hz throttled to 100 Hz would send messages that are 5 ms old. On average the interval is
    kept.
    """

    def __init__(self, max_answers: int, max_bytes: int, size: Callable[[Item], int]) -> None:
        """Keep at most so many answers, and so many bytes of messages by the ``size`` of each."""
        self.dropped = 0
        """Messages replaced by newer ones because the client did not take them in time."""
        self._max_answers, self._max_bytes, self._size = max_answers, max_bytes, size
        # Bytes of all messages that wait.
        self._held = 0
        self._answers: deque[Item] = deque()
        self._topics: dict[str, _Topic[Item]] = {}
        self._pending: dict[str, None] = {}

    def subscribe(self, topic: str, interval: float, queue_length: int) -> None:
        """Keep messages of ``topic``, about ``interval`` [s] apart.

        A repeated call changes both numbers.
        """
        entry = self._topics.get(topic) or _Topic(interval, 1, deque())
        # A shorter interval counts from the last message, not only when the old one is over.
        entry.turn = min(entry.turn, entry.sent + interval)
        entry.due = min(entry.due, entry.turn)
        entry.interval, entry.most = interval, max(queue_length, 1)
        while len(entry.waiting) > entry.most:
            self._take(entry)
        self._topics[topic] = entry

    def unsubscribe(self, topic: str) -> None:
        """Forget ``topic`` and what waits of it."""
        if entry := self._topics.pop(topic, None):
            self._held -= sum(map(self._size, entry.waiting))
        self._pending.pop(topic, None)

    def put_answer(self, data: Item) -> bool:
        """Add an answer; return whether there was room.

        Only a client that reads nothing can cause that too many wait.
        """
        if len(self._answers) >= self._max_answers:
            return False
        self._answers.append(data)
        return True

    def put_message(self, topic: str, data: Item, now: float) -> None:
        """Add a message of a subscribed topic; the oldest one gives way when the queue is full."""
        entry = self._topics.get(topic)
        if entry is None:
            return
        size = self._size(data)
        while entry.waiting and (
            len(entry.waiting) >= entry.most or self._held + size > self._max_bytes
        ):
            # One that gives way before it was due is what the client has asked for, and no loss.
            self.dropped += entry.due <= now
            self._take(entry)
        entry.waiting.append(data)
        self._held += size
        if now >= entry.turn - _EARLY_PART * entry.interval:
            entry.due = now
        else:
            entry.due = entry.turn + (
                _LATE_PART * entry.interval if len(entry.waiting) == 1 else 0.0
            )
        self._pending[topic] = None

    def pop(self, now: float) -> Item | None:
        """Return the next packet that may go out at ``now``: answers first, then topics in turn."""
        # Somebody waits for each answer; of topics only the newest counts.
        if self._answers:
            return self._answers.popleft()
        for topic in self._pending:
            entry = self._topics[topic]
            if entry.due <= now:
                del self._pending[topic]
                entry.turn = max(entry.turn, now) + entry.interval
                entry.sent = now
                entry.due = entry.turn
                if len(entry.waiting) > 1:
                    self._pending[topic] = None
                return self._take(entry)
        return None

    def next_due(self) -> float | None:
        """Return when the next waiting packet may go out, or None when nothing waits."""
        if self._answers:
            return float("-inf")
        return min((self._topics[topic].due for topic in self._pending), default=None)

    def _take(self, entry: _Topic[Item]) -> Item:
        """Take the oldest message of a topic."""
        data = entry.waiting.popleft()
        self._held -= self._size(data)
        return data
