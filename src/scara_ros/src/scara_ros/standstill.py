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

    :meth:`seen` wants one caller at a time, :meth:`earliest` may be called beside it.
    """

    def __init__(self, now: float) -> None:
        """Begin alive at ``now`` [s]; every time here is that of the monotonic clock."""
        # One tuple, so that a reader in another thread sees both as they belong together.
        self._known: tuple[float, tuple[tuple[float, float], ...]] = (now, ())

    def seen(self, now: float) -> float:
        """Note that the process runs now; return the gap before it [s], 0 if it is short."""
        last, gaps = self._known
        gap = now - last
        if gap >= GAP_S:
            # Only those in whose wake something may still come.
            kept = tuple(one for one in gaps if now - one[1] < WAITING_S)
            self._known = (now, (*kept, (last, now)))
            return gap
        self._known = (max(now, last), gaps)
        return 0.0

    def earliest(self, now: float) -> float:
        """Return since when what is found at ``now`` may have waited [s]; ``now``: it has not."""
        last, gaps = self._known
        begins = [begin for begin, end in gaps if now - end < WAITING_S]
        if now - last >= GAP_S:
            begins.append(last)
        return min(begins, default=now)


def said(asked: float, now: float) -> bool:
    """Return whether somebody said when a request was asked for, as far as that can be true.

    Args:
        asked: By the monotonic clock of this machine [s]; 0, or no number: not said. What lies in
            the future was said by another clock.
        now: The same clock, now.
    """
    return 0.0 < asked <= now
