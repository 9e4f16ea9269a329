"""How often something may happen."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class RateLimit:
    """A bucket that fills with time: ``rate`` a second, at most ``burst``.

    ``level`` is what it holds at time ``at``.
    """

    rate: float
    burst: float
    level: float
    at: float

    def allow(self, now: float) -> bool:
        """Take one out, if there is one."""
        self.level = min(self.burst, self.level + max(0.0, now - self.at) * self.rate)
        self.at = now
        if self.level < 1.0:
            return False
        self.level -= 1.0
        return True
