"""What the engine asks of the links to both sides; every call returns at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from twin_controller.core.actions import (
    Command,
    FollowTwin,
    MoveTwin,
    SendTwin,
    StreamAhead,
    StreamReal,
)


class RealCommands(Protocol):
    """What the engine asks of the link to the real robot."""

    def stream(self, action: StreamReal) -> None:
        """Write one set point at its time."""

    def stream_ahead(self, action: StreamAhead) -> None:
        """Write set points ahead of their time."""

    def perform(self, command: Command) -> None:
        """Carry out one command on the real robot."""

    def override(self, speed_percent: float) -> None:
        """Set the override."""

    def grip(self, on: bool) -> None:
        """Switch the suction."""


class TwinCommands(Protocol):
    """What the engine asks of the link to the twin."""

    def follow(self, action: FollowTwin) -> None:
        """Send one set point."""

    def perform(self, action: SendTwin, stamp: float, reached: bool) -> None:
        """Send one motion command.

        Args:
            action: The command.
            stamp: The twin's ROS time.
            reached: The twin's data come.
        """

    def cap(self, speed_percent: float) -> None:
        """Send the speed cap."""

    def move(self, action: MoveTwin, done: Callable[[bool, str], None]) -> None:
        """Start a move; ``done`` is told how it ended."""

    def grip(self, on: bool, done: Callable[[bool, str], None]) -> None:
        """Switch the suction; ``done`` is told what came of it."""
