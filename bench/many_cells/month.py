"""Questions to a month of events of a hundred cells, and the one cell among them that drifts."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import TypeVar

from farm.desk.figures_io import figures_over
from farm.desk.history_io import History, Kept
from farm.desk.questions import Wanted, query
from farm.desk.reading_io import ask
from farm.keys import CellName
from farm.wire import Event
from msgspec.structs import replace
from rich.console import Console

from bench.second_world.figure import Figure
from bench.synthetic.invented import Invented

T = TypeVar("T")
CELLS, DAYS, DAY_S = 100, 30, 86400.0
PERIOD_S = 120.0
"""An event of each cell every two minutes: 2.16 million in all."""
AWAY, FROM_DAY = 41, 15
"""The cell whose lag grows, and the day from which on, by 2 % of its size a day."""
GROWTH = 0.02
ASKED = 9


def measure(share: float, folder: Path, console: Console) -> list[Figure]:
    """Write the month, a share of it in events, and ask."""
    history = folder / "month" / "events"
    end = time.time() // DAY_S * DAY_S
    begin = end - DAYS * DAY_S
    count = _write(history, begin, PERIOD_S / share, console)
    size = sum(file.stat().st_size for file in history.iterdir()) / 1e6

    def stops() -> int:
        return len(ask(history, *query(Wanted(end - 12 * 3600.0, stops=True, limit=100_000))).rows)

    def lag() -> set[str]:
        found = figures_over(history, begin, end, DAY_S)
        return {f"{each.cell} {each.figure}" for each in found if each.drifts}

    took, rows = _timed(stops)
    drift_s, named = _timed(lag)
    wanted = f"m/{Invented(AWAY, 0.0).name}"
    others = [name for name in named if not name.startswith(wanted)]
    console.print(f"{count} events, {size:.0f} MB; drifts: {sorted(named)} in {drift_s:.2f} s")
    of = f"{DAYS} days x {CELLS} cells"
    note = f"median of {ASKED}; {rows} stops among {count} events, {size:.0f} MB"
    missed = float(len(named) == len(others))
    return [
        Figure(f'{of}: "stops since 12 h"', "s", 0.5, took, note=note),
        Figure(f"{of}: drifting cell missed", "", 0.0, missed, note=wanted, always=True),
        Figure(f"{of}: other cells named", "", 0.0, len(others), note="drift of lag", always=True),
    ]


def _timed(question: Callable[[], T]) -> tuple[float, T]:
    """Return how long a question takes [s], median, and its answer."""
    took = []
    for _ in range(ASKED):
        begun = time.perf_counter()
        answer = question()
        took.append(time.perf_counter() - begun)
    return statistics.median(took), answer


def _write(folder: Path, begin: float, period_s: float, console: Console) -> int:
    """Write the events of all cells, day by day; return how many."""
    cells = [Invented(k, begin, 1.0 / period_s) for k in range(CELLS)]
    names = [CellName("site", "m", cell.name) for cell in cells]
    count, chance, a_day = 0, Random(1), int(DAY_S / period_s)
    with History(folder, 64, 16.0) as history:
        for day in range(DAYS):
            numbers = range(day * a_day + 1, (day + 1) * a_day + 1)
            for name, cell in zip(names, cells):
                growth = GROWTH * max(0, day - FROM_DAY) * (cell.index == AWAY)
                history.write(
                    [
                        Kept(name, 0, _late(cell.event(number), 1.0 + growth, chance))
                        for number in numbers
                    ]
                )
                count += len(numbers)
            history.join()
            console.print(f"day {day + 1}: {count} events", highlight=False)
    return count


def _late(event: Event, factor: float, chance: Random) -> Event:
    """Return an event whose lag is larger, with a noise of 1 % from cycle to cycle."""
    if event.kind != "cycle":
        return event
    lag = event.body["follower_lag_s"] * factor * chance.gauss(1.0, 0.01)
    return replace(event, body={**event.body, "follower_lag_s": lag})
