"""One link that shows a cell, and how long its calls take: for a desk that is frozen meanwhile.

Usage: python -m bench.many_cells.putting PORT. It shows states until its input ends, and prints
one line of JSON then.
"""

from __future__ import annotations

import json
import os
import select
import sys
import threading
import time

from farm.bus_io import wait_for_desk
from farm.config import load_farm
from farm.keys import CellName
from farm.link.cell_link_io import CellLink
from farm.link.shown import ShownState, show
from farm.wire import Answer
from msgspec.structs import replace

from bench.many_cells.cost import memory_mb
from bench.synthetic.invented import Invented, InventedJournal

RATE_HZ = 20.0
"""Four times the rate of a cell's states, so that a worst one is met sooner."""
SETTLED_S = 20.0
"""Memory counts from here on: what a session takes at its start has come."""


class TimedLink(CellLink):
    """A link that knows its slowest put [s]."""

    slowest = 0.0

    def _put(self, what: str, data: bytes) -> None:
        begun = time.perf_counter()
        super()._put(what, data)
        self.slowest = max(self.slowest, time.perf_counter() - begun)


def main(port: int) -> None:
    """Show states until the input ends."""
    shipped = load_farm()
    config = replace(shipped, router=replace(shipped.router, port=port))
    cell = Invented(900, time.time(), 1.0)
    settings = replace(config.link, health_rate_hz=1.0)
    session = wait_for_desk(config.router, config.lease_ms, threading.Event())
    assert session is not None
    journal, name = InventedJournal(cell, time.time), CellName(config.site, "bench", "put")
    slowest, settled, shown = 0.0, 0.0, ShownState(0)
    with session, TimedLink(session, name, settings, journal, lambda _: Answer(True, "")) as link:
        print("{}", flush=True)
        begun = due = time.monotonic()
        while not select.select([sys.stdin], [], [], max(0.0, due - time.monotonic()))[0]:
            due = max(due + 1.0 / RATE_HZ, time.monotonic())
            shown, state = show(shown, cell.pair(time.time()), remote=False)
            at = time.perf_counter()
            link.show(state)
            slowest = max(slowest, time.perf_counter() - at)
            if not settled and time.monotonic() - begun > SETTLED_S:
                settled = memory_mb(os.getpid())
        grown = memory_mb(os.getpid()) - settled if settled else 0.0
        told = {"show_ms": 1e3 * slowest, "put_ms": 1e3 * link.slowest, "grown_mb": grown}
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
