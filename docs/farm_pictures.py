"""Take the pictures of docs/operating/farm.md again: the desk's page with invented cells.

    source env.sh; .venv/bin/python docs/farm_pictures.py [FOLDER]

FOLDER is docs/images/farm unless it is named. A real desk shows 20 invented cells and one that is
killed; one of the cells is stopped on the page. The pictures are taken while one of them shows a
fault, at four sizes, light and dark. Its history holds an invented class, which has a picture of
its own. Takes two minutes.
"""

from __future__ import annotations

import re
import signal
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from farm.desk.history_io import History, Kept  # noqa: E402
from farm.keys import CellName  # noqa: E402
from farm.wire import Event  # noqa: E402
from harness.course import exercise  # noqa: E402
from harness.processes import Stage, free_port, wait_until  # noqa: E402
from harness.wires.browser import chromium  # noqa: E402
from harness.workspace import workspace_environment  # noqa: E402
from playwright.sync_api import Page, expect  # noqa: E402

TOKEN = "token-of-the-pictures"
CELLS = 20
READY_S, FAULT_MS = 60.0, 130_000
"""An invented cell shows a fault once in two minutes."""
SIZES = {"phone": (390, 844), "tablet": (820, 1180), "low": (1280, 800), "wide": (1920, 1080)}
STOPPED = "practice/made_up_005"
LEARNERS, EXERCISES = ("ada", "bob", "cem", "dana", "eva", "finn", "gita", "hugo"), 12


def write_class(folder: Path) -> None:
    """Write the history of a class in its second week: each learner is at another exercise."""
    told = []
    for k, learner in enumerate(LEARNERS):
        for n in range(1, min(EXERCISES, 5 + k) + 1):
            tries = 1 + (n * (k + 2)) % 3
            for again in range(tries):
                at = time.time() - 3600.0 * (24 * 7 - 5 * n - k) + 300.0 * again
                passed = again == tries - 1 and n < 5 + k
                body = {"learner": learner, "exercise": exercise(n).name}
                body |= {"title": exercise(n).title, "passed": passed, "marked": at}
                body["signature"] = f"{learner} {n} {again}"
                event = Event(len(told) + 1, at, "exercise", False, "", body)
                told.append(Kept(CellName("class", f"laptop_{k + 1}", "cell"), 0, event))
    with History(folder / "events", 4, 16.0) as history:
        history.write(told)


def take_class(page: Page, out: Path) -> None:
    """Take the class alone."""
    expect(page.locator("#class tbody tr")).to_have_count(len(LEARNERS), timeout=1e3 * READY_S)
    page.locator("#class-card").screenshot(path=out / "class.png")


def take(page: Page, out: Path) -> None:
    """Wait for a fault, stop another cell, and take the pictures."""
    cells, title = page.locator(".cell"), page.locator(".cell-title")
    expect(cells).to_have_count(CELLS + 1, timeout=1e3 * READY_S)
    expect(title.filter(has_text="Lost")).to_have_count(1, timeout=1e3 * READY_S)
    equal = page.locator(".alarm-head", has_text=re.compile(rf"{CELLS + 1} × real"))
    expect(equal).to_have_count(1, timeout=1e3 * READY_S)
    expect(title.filter(has_text="Fault").first).to_be_visible(timeout=FAULT_MS)
    page.locator(f"[data-command=STOP][data-cell='{STOPPED}']").click()
    expect(page.locator(f"[data-cell='{STOPPED}'] .cell-title")).to_have_text("Stopped")
    page.evaluate("document.activeElement.blur(); window.scrollTo(0, 0)")
    page.mouse.move(0, 0)
    for name, (width, height) in SIZES.items():
        page.set_viewport_size({"width": width, "height": height})
        for colours in ("light", "dark"):
            page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            page.wait_for_function(
                "(dark) => document.body.classList.contains('body--dark') === dark",
                arg=colours == "dark",
            )
            page.evaluate(
                "() => new Promise((drawn) => requestAnimationFrame(() => setTimeout(drawn)))"
            )
            page.screenshot(path=out / f"{name}_{colours}.png")
    assert title.filter(has_text="Fault").count(), "the fault was over before all were taken"


def main() -> None:
    """Take all pictures."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "docs" / "images" / "farm")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        stage = Stage(folder / "log", {**workspace_environment(), "FARM_DESK_TOKEN": TOKEN})
        port, router = free_port(), ("--router-port", str(free_port()))
        where = ("--folder", str(folder / "farm"), "--port", str(port), "--person", "ann")
        try:
            write_class(folder / "farm")
            desk = stage.start(sys.executable, "-m", "farm", *where, *router)
            wait_until(lambda: "?token=" in desk.output, READY_S, "the page's address")
            practice = (sys.executable, "-m", "bench.synthetic", *router)
            stage.start(*practice, "--cells", str(CELLS), cwd=ROOT)
            other = stage.start(*practice, "--cells", "1", "--first", str(CELLS), cwd=ROOT)
            wait_until(lambda: "all have joined" in other.output, READY_S, "the last cell")
            with chromium(folder) as browser:
                page = browser.new_page(viewport={"width": 1280, "height": 800})
                page.goto(f"http://127.0.0.1:{port}/?token={TOKEN}")
                expect(page.locator(".cell")).to_have_count(CELLS + 1, timeout=1e3 * READY_S)
                other.signal(signal.SIGKILL)
                take_class(page, out)
                take(page, out)
        finally:
            stage.close(grace=8.0)
    print(f"pictures: {out}")


if __name__ == "__main__":
    main()
