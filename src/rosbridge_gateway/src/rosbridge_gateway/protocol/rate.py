"""How much of something may happen in a time."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class RateLimit:
    """A bucket that fills with time: ``rate`` a second, at most ``burst``.

    ``level`` is what it holds at time ``at``; below 0 it is in debt.
    """

    rate: float
    burst: float
    level: float
    at: float

    @classmethod
    def full(cls, rate: float, seconds: float, now: float) -> RateLimit:
        """Return a full bucket that holds so many seconds' worth."""
        return cls(rate, rate * seconds, rate * seconds, now)

    def allow(self, now: float) -> bool:
        """Take one out, if there is one."""
        self._fill(now)
        if self.level < 1.0:
            return False
        self.level -= 1.0
        return True

    def spend(self, amount: float, now: float) -> None:
        """Take out what has been used already, whether it was there or not."""
        self._fill(now)
        self.level -= amount

    def wait(self, now: float) -> float:
        """Return how long [s] the debt lasts; 0 without debt."""
        self._fill(now)
        return max(0.0, -self.level / self.rate)

    def _fill(self, now: float) -> None:
        self.level = min(self.burst, self.level + max(0.0, now - self.at) * self.rate)
        self.at = max(self.at, now)


class Budget:
    """What one connection may take of the gateway: packets, bytes and processor time.

    It is judged before a packet is decoded. What has been taken is paid back by waiting: nothing
    is refused or lost, it is read later. ``shared`` is processor time that several connections
    have together.
    """

    def __init__(
        self,
        packets_per_second: float,
        bytes_per_second: float,
        cpu_share: float,
        burst: float,
        now: float,
        shared: RateLimit | None = None,
    ) -> None:
        """Begin with full buckets.

        Args:
            packets_per_second: Packets.
            bytes_per_second: Bytes, as they come from the socket.
            cpu_share: Processor time [s/s].
            burst: So much time's worth [s] may be taken at once.
            now: Monotonic [s].
            shared: Processor time of all connections of this kind.
        """
        self._packets = RateLimit.full(packets_per_second, burst, now)
        self._bytes = RateLimit.full(bytes_per_second, burst, now)
        own = RateLimit.full(cpu_share, burst, now)
        self._cpu = [own] + ([shared] if shared is not None else [])

    def received(self, octets: int, now: float) -> None:
        """Charge bytes that came."""
        self._bytes.spend(octets, now)

    def packet(self, now: float) -> None:
        """Charge one packet."""
        self._packets.spend(1.0, now)

    def computed(self, seconds: float, now: float) -> None:
        """Charge processor time [s]."""
        for bucket in self._cpu:
            bucket.spend(seconds, now)

    def wait(self, now: float) -> float:
        """Return after how long [s] the next bytes may be looked at; 0: at once."""
        return max(self._packets.wait(now), self._bytes.wait(now), self.wait_for_cpu(now))

    def wait_for_cpu(self, now: float) -> float:
        """Return how long [s] the debt of processor time lasts."""
        return max(bucket.wait(now) for bucket in self._cpu)
