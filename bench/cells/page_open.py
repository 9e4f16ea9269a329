"""What a browser takes that looks at a whole cell, on a machine without a graphics card."""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from harness.processes import wait_until
from harness.wires.browser import chromium

from bench.cells.cell_run import Outcome, run_experiments, started
from bench.cells.whole_cell import start_cell
from bench.room import Room

SIZE = {"width": 1280, "height": 720}
SHOWN_MS, REST_S = 60_000, 15.0
TOLD_S = 10.0
ADDRESS = re.compile(r"operator's page\s+(http://\S+)", re.IGNORECASE)


@dataclass(frozen=True)
class Looked:
    """Processor time of the browser, all its processes together [percent of a core].

    Attributes:
        rest: While nothing moves.
        moving: While the robot leads.
        note: What attempts said that left no report.
    """

    rest: float
    moving: float
    note: str


def look(room: Room) -> Looked:
    """Open the operator's page of a whole cell, drawn by the processor, and let the robot lead.

    Raises:
        AssertionError: The page's address was not told.
        RuntimeError: The experiment ended.
    """
    folder = room.place("page_open")
    with started(folder, start_cell) as cell, chromium(folder, draws=True) as browser:
        said = cell.stage.processes[0]
        address = wait_until(lambda: ADDRESS.search(said.output), TOLD_S, "the page's address")
        assert address is not None
        page = browser.new_page(viewport=SIZE)  # type: ignore[arg-type]
        page.goto(address[1])
        page.wait_for_selector("[data-panel].shown", timeout=SHOWN_MS)
        page.wait_for_function("document.querySelector('.scene-body canvas') !== null")
        room.say("at rest, then the robot's program twice, with a page open")
        rest = _share(lambda: page.wait_for_timeout(REST_S * 1e3))
        outcomes: list[Outcome] = []
        lead = partial(run_experiments, cell, folder / "run", "real_leads", repeat=2)
        moving = _share(lambda: outcomes.append(lead()))
        return Looked(rest, moving, outcomes[0].note)


def _share(action: Callable[[], object]) -> float:
    """Return what the browsers below this process took while ``action`` ran [percent]."""
    before, begun = _ticks(), time.monotonic()
    action()
    taken = sum(ticks - before.get(pid, 0) for pid, ticks in _ticks().items())
    return 100.0 * taken / os.sysconf("SC_CLK_TCK") / (time.monotonic() - begun)


def _ticks() -> dict[int, int]:
    """Return the processor time of each process of a browser below this one [ticks]."""
    parents, found = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended just now
            name, _, rest = (folder / "stat").read_text().partition("(")[2].rpartition(")")
            fields = rest.split()
            parents[int(folder.name)] = int(fields[1])
            if name.startswith("chrom"):
                found[int(folder.name)] = int(fields[11]) + int(fields[12])

    def is_ours(pid: int) -> bool:
        while pid > 1:
            if pid == os.getpid():
                return True
            pid = parents.get(pid, 0)
        return False

    return {pid: ticks for pid, ticks in found.items() if is_ours(pid)}
