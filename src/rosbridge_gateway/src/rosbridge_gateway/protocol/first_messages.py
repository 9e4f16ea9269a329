"""What a client publishes before its subscribers have connected.

A publisher's subscribers connect some milliseconds after it is advertised. Until then ROS drops
what is published, so the shortest script of a client's documentation reached nobody.
"""

from __future__ import annotations

from collections import deque
from typing import Any

from rosbridge_gateway.config import FirstMessages
from rosbridge_gateway.protocol.names import any_of, patterns_in


class KeepRules:
    """Which first messages may reach a subscriber late.

    Nothing that moves or stops a robot at once may: a set point or a jog is meant for the instant
    at which it was sent, and a stop, resume or cancel that comes late undoes what was commanded
    meanwhile. The goal of an action may, until a stop comes.
    """

    def __init__(self, config: FirstMessages, namespace: str) -> None:
        self.config = config
        never = patterns_in(config.never_topics, namespace)
        self._topics = any_of(pattern.lower() for pattern in never)
        self._types = any_of(config.never_types)
        goals = patterns_in(config.until_stop_topics, namespace)
        self._goal_topics = any_of(pattern.lower() for pattern in goals)
        self._goal_types = any_of(config.until_stop_types)

    def keeps(self, topic: str, type_name: str) -> bool:
        """Tell whether messages of ``topic`` (absolute) and ``package/Type`` may come late."""
        return not self._topics.match(topic.lower()) and not self._types.match(type_name)

    def until_stop(self, topic: str, type_name: str) -> bool:
        """Tell whether messages of ``topic`` are forgotten when a stop comes."""
        return bool(self._goal_topics.match(topic.lower()) or self._goal_types.match(type_name))


class FirstOnes:
    """The messages of a topic's first second, each for as long as it is young.

    Times are monotonic [s].
    """

    def __init__(self, config: FirstMessages, now: float) -> None:
        self._life = config.seconds
        self._accepts_until = now + config.seconds
        self._kept: deque[tuple[float, Any]] = deque(maxlen=config.count)

    def extend(self, now: float) -> None:
        """Begin the first second again; what is kept stays as long as it would."""
        self._accepts_until = now + self._life

    def add(self, message: Any, now: float) -> None:
        """Keep a message if the first second is not over; the oldest gives way to it."""
        if now <= self._accepts_until:
            self._kept.append((now, message))

    def young(self, now: float) -> list[Any]:
        """Return the messages that a subscriber who connects now is to get, in order."""
        while self._kept and now - self._kept[0][0] > self._life:
            self._kept.popleft()
        return [message for _, message in self._kept]

    def forget(self, until: float, now: float) -> bool:
        """Forget what came until then; return whether some of it could still be handed on."""
        before = len(self.young(now))
        self._kept = deque((one for one in self._kept if one[0] > until), self._kept.maxlen)
        return len(self._kept) < before

    def over_in(self, now: float) -> float:
        """Return how long [s] it lasts until nothing can be kept or handed on any more."""
        last = self._kept[-1][0] if self._kept else float("-inf")
        return max(0.0, self._accepts_until - now, last + self._life - now)

    def wanted_for(self, now: float) -> float:
        """Return how long [s] a message is still kept for subscribers to come."""
        return max(0.0, self._kept[-1][0] + self._life - now) if self._kept else 0.0
