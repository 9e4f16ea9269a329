"""Numbers that a rosbridge link is given, and numbers that it counts."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True, slots=True)
class LinkSettings:
    """Times of a link [s].

    Attributes:
        silent_timeout: A peer that sends nothing for this long, not even a pong, counts as dead.
        send_timeout: The longest that sending may block.
        connect_timeout: Of connecting, at each step of the handshake.
        retry_first: Pause before the first new attempt; doubled at each failure.
        retry_last: Longest pause.
    """

    silent_timeout: float = 0.25
    send_timeout: float = 0.05
    connect_timeout: float = 1.0
    retry_first: float = 0.1
    retry_last: float = 2.0


@dataclasses.dataclass(slots=True)
class LinkCounters:
    """What went over the link since its start."""

    sent: int = 0
    received: int = 0
    rejected: int = 0
    refused: int = 0
    connects: int = 0
    callback_errors: int = 0
