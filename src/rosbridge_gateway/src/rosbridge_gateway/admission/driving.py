"""Which connections move the robot."""

from __future__ import annotations

from collections.abc import Iterable

from rosbridge_gateway.config import Driving
from rosbridge_gateway.protocol.names import any_of, patterns_in


class Drivers:
    """The roles and topics of gateway.yaml that move the robot, in one namespace."""

    def __init__(self, driving: Driving, namespace: str) -> None:
        self._roles = frozenset(driving.roles)
        self._topics = any_of(patterns_in(driving.topics, namespace))

    def drives(self, role: str, advertised: Iterable[str]) -> bool:
        """Tell whether a client moves the robot.

        Args:
            role: Role of the client.
            advertised: Absolute names of the topics that it publishes.
        """
        return role in self._roles or any(self._topics.match(name) for name in advertised)
