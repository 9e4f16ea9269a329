"""What waits for one client: answers in order, and per topic only the newest messages."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field


@dataclass(slots=True)
class _Topic:
    """The waiting messages of one subscription; ``not_before`` is when the next may go out."""

    interval: float
    waiting: deque[bytes]
    not_before: float = field(default=float("-inf"))


class Outbox:
    """Packets that a client has not taken yet, bounded whatever the client does.

    Each topic keeps its newest ``queue_length`` messages (at least one); answers are kept in order up to a number.
    """

    def __init__(self, max_answers: int) -> None:
        self.dropped = 0
        """Messages replaced by newer ones before they could be sent."""
        self._max_answers = max_answers
        self._answers: deque[bytes] = deque()
        self._topics: dict[str, _Topic] = {}
        self._pending: dict[str, None] = {}

    def subscribe(self, topic: str, interval: float, queue_length: int) -> None:
        """Keep messages of ``topic``, at least ``interval`` [s] apart; a repeated call changes both numbers."""
        before = self._topics.get(topic)
        fresh = _Topic(interval, deque(before.waiting if before else (), maxlen=max(queue_length, 1)))
        if before:
            fresh.not_before = before.not_before - before.interval + interval
        self._topics[topic] = fresh

    def unsubscribe(self, topic: str) -> None:
        """Forget ``topic`` and what waits of it."""
        self._topics.pop(topic, None)
        self._pending.pop(topic, None)

    def put_answer(self, data: bytes) -> bool:
        """Add an answer; False when too many wait already, which only a client that reads nothing can cause."""
        if len(self._answers) >= self._max_answers:
            return False
        self._answers.append(data)
        return True

    def put_message(self, topic: str, data: bytes) -> None:
        """Add a message of a subscribed topic; the oldest one gives way when the queue is full."""
        entry = self._topics.get(topic)
        if entry is None:
            return
        if len(entry.waiting) == entry.waiting.maxlen:
            self.dropped += 1
        entry.waiting.append(data)
        self._pending[topic] = None

    def pop(self, now: float) -> bytes | None:
        """Return the next packet that may go out at ``now``: answers first, then topics in turn."""
        if self._answers:
            return self._answers.popleft()
        for topic in self._pending:
            entry = self._topics[topic]
            if entry.not_before <= now:
                del self._pending[topic]
                if len(entry.waiting) > 1:
                    self._pending[topic] = None
                entry.not_before = now + entry.interval
                return entry.waiting.popleft()
        return None

    def next_due(self) -> float | None:
        """Return when the next waiting packet may go out, or None when nothing waits."""
        if self._answers:
            return float("-inf")
        return min((self._topics[topic].not_before for topic in self._pending), default=None)
