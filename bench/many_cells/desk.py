"""A desk that is measured: it answers words on its standard input with a line of JSON each.

Usage: python -m bench.many_cells.desk FOLDER PORT. Words: ``count``, ``begin`` a measurement,
``end`` it, ``stops``, ``losses``.
"""

from __future__ import annotations

import json
import os
import statistics
import sys
import time
from pathlib import Path
from typing import Any

import zenoh
from farm.bus_io import open_router
from farm.config import FarmConfig, load_farm
from farm.desk.commands_io import cells_there, order
from farm.desk.desk_io import Desk
from farm.desk.history_io import History
from farm.desk.roster import LOST, SILENT
from farm.keys import ALIVE, every
from msgspec.structs import replace

STOPS = 200


class Measured:
    """Counts what a desk gets between two words."""

    def __init__(self, desk: Desk, config: FarmConfig) -> None:
        self._desk, self._config = desk, config
        self._ages = desk.measure_ages()
        self._cpu = self._at = 0.0
        self._before = 0
        self._gone: list[str] = []
        self._tokens = desk.session.liveliness().declare_subscriber(
            every(config.site, ALIVE), self._on_token
        )

    def count(self) -> dict[str, Any]:
        """Return who is there."""
        rows = self._desk.rows()
        there = [row for row in rows if row.status != LOST]
        return {
            "alive": len(there),
            "shown": sum(row.state is not None for row in there),
            "names": [row.name.partition("/")[2] for row in there],
            "lost_since": {r.name.partition("/")[2]: r.since for r in rows if r.status == LOST},
        }

    def begin(self) -> dict[str, Any]:
        """Begin to count processor time and ages."""
        self._ages.clear()
        self._cpu, self._at = time.process_time(), time.monotonic()
        self._before = self._received()
        return {}

    def end(self) -> dict[str, Any]:
        """Return what was counted; states are counted since the desk's start."""
        seconds = time.monotonic() - self._at
        used = time.process_time() - self._cpu
        _, lost = zip(*self._desk.counted().values())
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return {
            "received": self._received(),
            "lost": sum(lost),
            "age_p50_ms": 1000.0 * statistics.median(self._ages),
            "age_p99_ms": 1000.0 * statistics.quantiles(self._ages, n=100)[98],
            "cpu_percent": 100.0 * used / seconds,
            "cpu_s": used,
            "cpu_us": 1e6 * used / max(1, self._received() - self._before),
            "memory_mb": pages * os.sysconf("SC_PAGE_SIZE") / 1e6,
        }

    def _received(self) -> int:
        return sum(received for received, _ in self._desk.counted().values())

    def losses(self) -> dict[str, Any]:
        """Return which cells were lost since the desk's start, and which are silent now."""
        silent = [row.name for row in self._desk.rows() if row.status == SILENT]
        return {"gone": list(self._gone), "silent": silent}

    def _on_token(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            self._gone.append(str(sample.key_expr))

    def stops(self) -> dict[str, Any]:
        """Return how soon single cells answer a STOP."""
        session, site = self._desk.session, self._config.site
        cells = cells_there(session, site, 1.0)
        answers = [
            answer
            for k in range(STOPS)
            for answer in order(session, [cells[k % len(cells)]], "STOP", "bench", "bench", 2.0)
        ]
        seconds = [answer.seconds for answer in answers]
        return {
            "stop_p99_ms": 1000.0 * statistics.quantiles(seconds, n=100)[98],
            "stop_unanswered": sum(answer.answer is None for answer in answers),
        }


def main(folder: Path, port: int) -> None:
    """Answer words until the input ends."""
    shipped = load_farm()
    config = replace(shipped, router=replace(shipped.router, port=port))
    with (
        History(folder, config.desk.small_files, config.desk.small_file_mb) as history,
        open_router(config.router, config.lease_ms) as session,
        Desk(session, config, history) as desk,
    ):
        measured = Measured(desk, config)
        words = {
            "count": measured.count,
            "begin": measured.begin,
            "end": measured.end,
            "stops": measured.stops,
            "losses": measured.losses,
        }
        print("{}", flush=True)
        for line in sys.stdin:
            print(json.dumps(words[line.strip()]()), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
