"""A desk that is killed again and again, links too: each event is kept once and in order."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path
from random import Random

from farm.desk.reading_io import ask
from rich.console import Console

from bench.many_cells.stage import JOIN_S, PROCESSES, end, farm
from bench.second_world.figure import Figure

CELLS, KILLS, WHOLE_S = 100, 20, 600.0
EVENTS_HZ = 1.0
COUNTED = """
SELECT count(*), count(DISTINCT (machine, cell, era, number)), count(DISTINCT (machine, cell)),
       min(number), max(number), max(era)
FROM events
"""
ORDERED = """
SELECT count(*) FROM (
  SELECT time < lag(time) OVER (PARTITION BY machine, cell ORDER BY era, number) AS wrong
  FROM events) WHERE wrong
"""
CATCH_UP_S = 60.0


def measure(share: float, folder: Path, console: Console) -> list[Figure]:
    """Kill the desk 20 times in ten minutes, and each time one process of links."""
    seconds, kills = WHOLE_S * share, max(2, round(KILLS * share))
    # The journals end here, so that everything can have come.
    events = int(seconds * EVENTS_HZ)
    begin, chance = time.time(), Random(1)
    with farm(folder / "restarts") as stage:

        def links(part: int) -> subprocess.Popen[str]:
            words = ("--cells", str(CELLS // PROCESSES), "--first", str(part * CELLS // PROCESSES))
            words += ("--rate", "1", "--events-rate", str(EVENTS_HZ), "--begin", str(begin))
            words += ("--events-until", str(events), "--router-port", str(stage.port))
            return stage.start("bench.synthetic", *words)

        processes = [links(part) for part in range(PROCESSES)]
        stage.wait(lambda told: told["alive"] == CELLS, JOIN_S, "all cells")
        for kill in range(kills):
            left = begin + (kill + chance.uniform(0.2, 0.8)) * seconds / kills - time.time()
            time.sleep(max(0.0, left))
            stage.restart()
            part = kill % PROCESSES
            end(processes[part])
            processes[part] = links(part)
            console.print(f"desk killed {kill + 1} times", highlight=False)
        history, until = folder / "restarts" / "events", time.monotonic() + CATCH_UP_S
        until += max(0.0, begin + seconds - time.time())
        rows = ask(history, COUNTED).rows[0]
        while rows[1] != CELLS * events and time.monotonic() < until:
            time.sleep(1.0)
            rows = ask(history, COUNTED).rows[0]
        wrong = ask(history, ORDERED).rows[0][0]
    all_rows, distinct = int(str(rows[0])), int(str(rows[1]))
    console.print(f"kept, different, cells, first, last, eras: {rows}; out of order: {wrong}")
    case = f"desk and links killed {kills} times in {seconds:.0f} s"
    note = f"of {CELLS * events} events of {CELLS} cells"
    return [
        Figure(f"{case}: missing", "", 0.0, CELLS * events - distinct, note=note, always=True),
        Figure(f"{case}: doubled", "", 0.0, all_rows - distinct, note=note, always=True),
        Figure(f"{case}: out of order", "", 0.0, int(str(wrong)), note=note, always=True),
    ]
