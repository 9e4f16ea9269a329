"""How soon a STOP of the desk's page is answered, and that no wrong command reaches a robot."""

from __future__ import annotations

import sys
import time
import uuid
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from farm.bus_io import open_client, open_router
from farm.config import load_farm
from farm.keys import COMMAND, CellName
from farm.link.cell_link_io import CellLink
from farm.wire import Answer, CellState, Command, Level, decode, encode
from harness.processes import Stage, free_port, wait_until
from harness.wires.browser import chromium
from harness.workspace import workspace_environment
from msgspec.structs import replace
from rich.console import Console

from bench.many_cells.stage import JOIN_S
from bench.second_world.figure import Figure
from bench.synthetic.invented import Invented, InventedJournal

CELLS, STOPS, WRONG = 20, 1000, 1000
TOKEN = "token-of-a-measured-page"
EXPIRY_S = 2.0
PRESS = """
async ([count, patience]) => {
  const answers = document.getElementById("answers"), took = [];
  const buttons = [...document.querySelectorAll(".cell [data-command=STOP]")];
  for (let k = 0; k < count; k += 1) {
    const button = buttons[k % buttons.length], cell = button.dataset.cell;
    answers.replaceChildren();
    took.push(await new Promise((done) => {
      const begun = performance.now();
      const watch = new MutationObserver(() => {
        const there = [...answers.children].some((line) => line.textContent.includes("received"));
        if (there) { watch.disconnect(); done(performance.now() - begun); }
      });
      watch.observe(answers, { childList: true });
      setTimeout(() => { watch.disconnect(); done(null); }, patience);
      button.dispatchEvent(new PointerEvent("pointerdown", { bubbles: true, button: 0 }));
    }));
  }
  return took;
}
"""


def measure_page(share: float, folder: Path, console: Console) -> list[Figure]:
    """Press STOP on the page of 20 cells; the time ends when the page shows "received"."""
    count = max(20, round(STOPS * share))
    port, router = free_port(), str(free_port())
    stage = Stage(folder / "stops", {**workspace_environment(), "FARM_DESK_TOKEN": TOKEN})
    try:
        words = ("--folder", str(folder / "stops" / "farm"), "--port", str(port))
        desk = stage.start(sys.executable, "-m", "farm", *words, "--router-port", router)
        cells = ("--cells", str(CELLS), "--router-port", router)
        stage.start(sys.executable, "-m", "bench.synthetic", *cells)
        wait_until(lambda: "?token=" in desk.output, JOIN_S, "the page's address")
        with chromium(folder) as browser:
            page = browser.new_page(viewport={"width": 1600, "height": 900})
            page.goto(f"http://127.0.0.1:{port}/?token={TOKEN}")
            shown = page.locator(".cell")
            wait_until(lambda: shown.count() == CELLS, JOIN_S, "all cells on the page")
            took = page.evaluate(PRESS, [count, 1e3 * EXPIRY_S])
    finally:
        stage.close()
    answered = [each for each in took if each is not None]
    console.print(f"median {np.median(answered):.1f} ms, worst {max(answered):.1f} ms")
    note = f"p99 of {count} presses in Chromium, until the page shows the answer"
    p99 = float(np.percentile(answered, 99))
    return [
        Figure('STOP on the page to "received"', "ms", 50.0, p99, note=note),
        Figure("STOP on the page, not answered", "", 0.0, count - len(answered), always=True),
    ]


def measure_wrong(share: float, folder: Path, console: Console) -> list[Figure]:
    """Send commands that a cell must refuse, of five kinds; count what reaches it."""
    shipped = load_farm()
    config = replace(shipped, router=replace(shipped.router, port=free_port()))
    cell, reached, silent = CellName(config.site, "m", "a"), list[Command](), 0
    rounds = max(2, round(WRONG * share) // 5)

    def obey(command: Command) -> Answer:
        reached.append(command)
        return Answer(True, "done")

    # A mover, so that a stale picture is what is refused, not the person.
    rights = replace(config.link.rights, persons={"ann": "mover"})
    with ExitStack() as ends:
        session = ends.enter_context(open_router(config.router, config.lease_ms))
        client = ends.enter_context(open_client(config.router, config.lease_ms, EXPIRY_S))
        journal = InventedJournal(Invented(0, time.time()), time.time)
        settings = replace(config.link, rights=rights, health_rate_hz=1.0)
        link = ends.enter_context(CellLink(client, cell, settings, journal, obey))
        link.show(CellState(1, time.time(), 7, Level.GOOD, "IDLE", remote=True))

        def ask(command: Command) -> Answer:
            (reply,) = session.get(cell.key(COMMAND), payload=encode(command), timeout=EXPIRY_S)
            return decode(bytes(reply.ok.payload), Answer)

        def make(word: str, person: str, left: float = EXPIRY_S, base: int | None = 7) -> Command:
            return Command(uuid.uuid4().hex, word, person, "bench", time.time() + left, base)

        for _ in range(rounds):
            taken = make("HOME", "ann")
            assert ask(taken).accepted
            wrong = [
                make("HOME", "ann", left=-0.1),
                taken,
                make("HOME", "ann", base=6),
                make("HOME", "bob"),
                make("DANCE", "ann"),
            ]
            answers = [ask(command) for command in wrong]
            silent += sum(answer.accepted or not answer.text for answer in answers)
    note = f"of {5 * rounds}: expired, repeated, stale, not allowed, unknown"
    extra = len(reached) - rounds
    console.print(f"{rounds} right commands reached the cell, {extra} others")
    return [
        Figure("wrong commands that reach a cell", "", 0.0, extra, note=note, always=True),
        Figure("wrong commands without a reason", "", 0.0, silent, note=note, always=True),
    ]
