"""When to publish what is shown at a rate and, as soon as it changes, at once."""

from __future__ import annotations


class Pace:
    """Says when something is due: a period after the last time, or when what is shown has changed.

    The unit of time is the caller's: seconds, nanoseconds or calls.
    """

    def __init__(self, period: float) -> None:
        """Remember the period; the first question is always answered with yes."""
        self._period = period
        self._last: float | None = None
        self._shown: object = None

    def is_due(self, now: float, shown: object = None) -> bool:
        """Return whether to publish now, and take it as published if so.

        Args:
            now: The time. If it is before the last publication's, that counts as due.
            shown: What makes a publication worth it before its time: compared with the last one's.
        """
        last = self._last
        if last is not None and last <= now < last + self._period and shown == self._shown:
            return False
        self._last, self._shown = now, shown
        return True

    def hurry(self) -> None:
        """Make the next question be answered with yes."""
        self._last = None
