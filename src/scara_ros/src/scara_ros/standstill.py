"""Know when the own process may have stood still, and since when what it finds may have waited.

A process that is stopped, or gets no processor, finds afterwards side by side what came one after
the other. So each sign that it runs is noted: its loop, and each message. Between two signs that
are far apart it may have stood still, or it has only rested; what comes right behind such a gap may
be as old as its beginning.
"""

from __future__ import annotations

GAP_S = 0.02
"""Two signs of life so far apart leave room for a standstill; our choice, two periods of a loop."""
WAITING_S = 0.05
"""What has waited in a gap is found within this time after it; our choice: a few thread switches of
5 ms each. A busier machine makes a new gap."""


class Standstill:
    """Keeps the newest gaps between signs of life.

    :meth:`seen` and :meth:`blocked` want one caller at a time, :meth:`earliest` may be called
    beside it.
    """

    def __init__(self, now: float) -> None:
        """Begin alive at ``now`` [s]; every time here is that of the monotonic clock."""
        # One tuple, so that a reader in another thread sees both as they belong together.
        self._known: tuple[float, tuple[tuple[float, float], ...]] = (now, ())

    def seen(self, now: float) -> float:
        """Note that the process runs now; return the gap before it [s], 0 if it is short."""
        last, _ = self._known
        self._known = (max(now, last), self._gaps(now))
        return now - last if now - last >= GAP_S else 0.0

    def blocked(self, begin: float, now: float) -> None:
        """Note that a reader was busy since ``begin`` [s]: what it reads next may have waited."""
        last, gaps = self._known
        if now - begin >= GAP_S:
            older = [one for one in gaps if one[0] < begin < one[1] + WAITING_S]
            self._known = (last, (*older, (begin, now)))

    def earliest(self, now: float) -> float:
        """Return since when what is found at ``now`` may have waited [s]; ``now``: it has not."""
        gaps = self._gaps(now)
        return gaps[0][0] if gaps and now - gaps[-1][1] < WAITING_S else now

    def found_by(self, now: float) -> float:
        """Return until when what has waited in a gap is still being found [s]; ``now``: nothing."""
        gaps = self._gaps(now)
        return max(now, gaps[-1][1] + WAITING_S) if gaps else now

    def _gaps(self, now: float) -> tuple[tuple[float, float], ...]:
        """Return the gaps up to ``now`` in whose wake something may still come."""
        last, gaps = self._known
        if now - last < GAP_S:
            return gaps
        # As of its beginning: while this one lasted nothing was found of those before.
        return (*(one for one in gaps if last - one[1] < WAITING_S), (last, now))


def said(asked: float, now: float) -> bool:
    """Return whether somebody said when a request was asked for, as far as that can be true.

    Args:
        asked: By the monotonic clock of this machine [s]; 0, or no number: not said. What lies in
            the future was said by another clock.
        now: The same clock, now.
    """
    return 0.0 < asked <= now
