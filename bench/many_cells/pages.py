"""What the desk takes for a hundred cells and one page, and for ten pages."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

from harness.processes import Stage, free_port, wait_until
from harness.wires.browser import chromium
from harness.workspace import workspace_environment
from playwright.sync_api import Browser, Page
from rich.console import Console

from bench.many_cells.commands import TOKEN
from bench.many_cells.cost import cpu_s
from bench.many_cells.stage import JOIN_S
from bench.second_world.figure import Figure

CELLS, PAGES, WHOLE_S = 100, 10, 60.0


def measure(share: float, folder: Path, console: Console) -> list[Figure]:
    """Look at 100 cells at 1 Hz with one page for a minute, then with ten."""
    seconds, port, router = WHOLE_S * share, free_port(), str(free_port())
    stage = Stage(folder / "pages", {**workspace_environment(), "FARM_DESK_TOKEN": TOKEN})
    try:
        words = ("--folder", str(folder / "pages" / "farm"), "--port", str(port))
        desk = stage.start(sys.executable, "-m", "farm", *words, "--router-port", router)
        cells = ("--cells", str(CELLS), "--rate", "1", "--router-port", router)
        stage.start(sys.executable, "-m", "bench.synthetic", *cells)
        wait_until(lambda: "?token=" in desk.output, JOIN_S, "the page's address")
        address = f"http://127.0.0.1:{port}/?token={TOKEN}"

        def over(look: Callable[[], object]) -> float:
            begun, at = cpu_s(desk.pid), time.monotonic()
            look()
            return 100.0 * (cpu_s(desk.pid) - begun) / (time.monotonic() - at)

        with chromium(folder) as browser:
            pages = [_opened(browser, address)]
            one = over(lambda: pages[0].wait_for_timeout(1e3 * seconds))
            pages += [_opened(browser, address) for _ in range(PAGES - 1)]
            ten = over(lambda: pages[0].wait_for_timeout(1e3 * seconds))
    finally:
        stage.close()
    console.print(f"one page {one:.1f} %, {PAGES} pages {ten:.1f} % of a core")
    of = f"{CELLS} cells at 1 Hz"
    return [
        Figure(f"{of}, one page: desk", "%", 60.0, one, note=f"of a core, {seconds:.0f} s"),
        Figure(f"{of}, {PAGES} pages", "x", 1.3, ten / one, note=f"times one page: {ten:.0f} %"),
    ]


def _opened(browser: Browser, address: str) -> Page:
    page = browser.new_page(viewport={"width": 1600, "height": 900})
    page.goto(address)
    shown = page.locator(".cell")
    wait_until(lambda: shown.count() == CELLS, JOIN_S, "all cells on the page")
    return page
