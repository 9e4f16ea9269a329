"""The page of a stage in a browser: scenes are chosen, sizes too, and what is wrong is told."""

from __future__ import annotations

import json
import shutil
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from playwright.sync_api import Page, TimeoutError, expect

from harness.processes import Stage, free_port, wait_until
from harness.running.shared import BROWSERS
from harness.running.thorough import thorough
from harness.wires.browser import LOAD_MS, kept_chromium
from harness.workspace import ROOT, workspace_environment

STAGE = ROOT / "tests" / "harness" / "page" / "stage.py"
MEASURE = (STAGE.parent / "measure.js").read_text(encoding="utf-8")
DRAWN = (STAGE.parent / "chart_texts.js").read_text(encoding="utf-8")
TOKEN = "token-of-the-stage"
RUNS = "runs"
SIZES = {"phone": (390, 844), "tablet": (768, 1024), "low": (1280, 720), "wide": (1920, 1080)}
ALARMS = 4
CARD = f"""# 9. Teach a pallet
To **teach** is <img src="x" onerror="window.loaded = 1"> to show ![it](x.png), [here](/events.csv).

## Task
1. `rosservice call /twin/payload/{"set_" * 30}mount`

| part | x y z, table | place x y z |
|---|---|---|
| 1 | 488.57 -177.93 -9.5, -90 | -10 -510 -19.2 |

## Hints
- First the pick.
- Then the place.
"""
PATIENCE_MS = 15_000
SLOW_MS = 60_000
"""For what a program of low priority brings: it gets what the others leave."""
LOOK_MS = 20
expect.set_options(timeout=PATIENCE_MS)
# Whether the page shows a scene with so many alarms.
PLAYED = """([scene, alarms]) =>
    document.querySelector('[data-live="jog"]')?.textContent === scene &&
    document.querySelectorAll(".alarm.warn, .alarm.error").length === alarms"""
# Nothing takes time to open or to fade.
STILL = """document.addEventListener("DOMContentLoaded", () => {
    const still = document.createElement("style");
    still.textContent = "*, ::before, ::after { transition: none !important; " +
        "animation-duration: 1ms !important; animation-delay: 0s !important; }";
    document.head.append(still);
})"""
# What opens or fades is shown as it is in the end, without the time that it takes.
SETTLE = """async () => {
    window.scrollTo(0, 0);
    for (let frames = 0; frames < 300; frames += 1) {
        const running = document.getAnimations().filter(({ playState }) => playState === "running");
        for (const one of running) one.finish();
        await new Promise(requestAnimationFrame);
        if (!running.length && !document.querySelector("[class*=-enter-active]")) return true;
    }
    return false;
}"""
# All that must stand still while alarms, commands and troubles come and go.
PLACES = """() => [...document.querySelectorAll(
    ".card, .strip, .bar, .bar-stop button, .theme, .commands button, .tabs button, " +
    ".jog button, .scene-choice button, .views button, .dock, [data-pause]")]
    .filter((place) => place.checkVisibility())
    .map((place) => { const box = place.getBoundingClientRect();
        const button = place.matches("button") && place.innerText.trim();
        const words = place.getAttribute("aria-label") || button || place.className;
        return [words, box.left, box.top + scrollY, box.width, box.height]; })"""


class Theatre:
    """The page of a stage whose scenes can be chosen."""

    def __init__(self, page: Page, address: str, runs: Path) -> None:
        """Open it as an operator; ``runs`` is the folder of its recordings."""
        self.page, self.address, self.runs = page, address, runs
        page.add_init_script(STILL)
        page.goto(f"{address}/?token={TOKEN}", timeout=LOAD_MS)
        expect(page.locator("[data-panel].shown")).to_be_visible(timeout=LOAD_MS)
        # A page that is still open may keep control right behind the beginning, once more.
        wait_until(self._nobody_in_control, 15.0, "nobody in control", period=0.5)

    def _nobody_in_control(self) -> bool:
        """Begin the stage's scene anew; return whether the page had shown that nobody holds it."""
        text = self.page.locator(".control-text").inner_text()
        self.page.request.get(f"{self.address}/begin")
        return text == "Nobody is in control"

    def play(self, scene: str) -> None:
        """Choose a scene, and wait until the page shows it."""
        with urllib.request.urlopen(f"{self.address}/scene/{scene}", timeout=10.0):
            pass
        until(self.page, PLAYED, [scene, ALARMS if scene == "alarmed" else 0])

    def remembered(self) -> None:
        """Wait until the page's server has kept a moment of what is shown now."""
        now = time.time()

        def newest() -> float:
            answer = self.page.request.get(f"{self.address}/past.json?at={now}")
            return float(answer.json()["last"])

        wait_until(lambda: newest() > now, 10.0, "a moment of this scene")

    def resize(self, size: str) -> None:
        """Choose a size; it is drawn when two frames have passed."""
        width, height = SIZES[size]
        self.page.set_viewport_size({"width": width, "height": height})
        self.settle()

    def settle(self) -> None:
        """Go to the upper end, and let each transition be at its end."""
        assert self.page.evaluate(SETTLE), "transitions that do not end"

    def problems(self, where: str, only: str = "") -> list[str]:
        """Return what is wrong with the page as it is now.

        Args:
            where: In words, for the sentences.
            only: A selector: what lies over all else; empty: the whole page.
        """
        self.settle()
        found: list[str] = self.page.evaluate(MEASURE, only)
        return [f"{where}: {text}" for text in found]

    def drawn_problems(self, where: str) -> list[str]:
        """Return what is wrong with the letters of the drawings that are shown now."""
        found: list[str] = self.page.evaluate(DRAWN)
        return [f"{where}: {text}" for text in found]

    def places(self) -> dict[Any, list[Any]]:
        """Return where everything stands."""
        found: list[list[Any]] = self.page.evaluate(PLACES)
        return {(index, row[0]): row[1:] for index, row in enumerate(found)}

    def open(self, tab: str) -> None:
        """Choose a tab."""
        self.page.get_by_role("tab", name=tab, exact=True).click()


@contextmanager
def open_theatre(folder: Path, robot: str = "") -> Iterator[Theatre]:
    """Start a stage and open its page.

    Args:
        folder: For logs and recordings.
        robot: Folder of config/robots; empty: the article's.
    """
    with started_stage(folder, robot) as address, kept_chromium() as browser:
        yield Theatre(browser.new_page(), address, folder / RUNS)


@contextmanager
def kept_theatre(draws: bool = False) -> Iterator[Theatre]:
    """Open a page of the stage that this process keeps; its scene is ready, nobody in control.

    Args:
        draws: Whether the browser draws the model; it does so without a graphics card.
    """
    with kept_chromium(draws) as browser:
        address, folder = BROWSERS.get("stage", _kept_stage)
        fill(folder / RUNS)
        with urllib.request.urlopen(f"{address}/begin", timeout=10.0):
            pass
        yield Theatre(browser.new_page(), address, folder / RUNS)


@contextmanager
def _kept_stage() -> Iterator[tuple[str, Path]]:
    with TemporaryDirectory(prefix="stage_") as folder, started_stage(Path(folder)) as address:
        yield address, Path(folder)


@contextmanager
def started_stage(folder: Path, robot: str = "") -> Iterator[str]:
    """Start a stage; give its address.

    Args:
        folder: For logs and recordings.
        robot: Folder of config/robots; empty: the article's.
    """
    fill(folder / RUNS)
    made = Stage(folder / "log", workspace_environment())
    port = free_port()
    try:
        words = [str(STAGE), str(port), str(folder / RUNS), *([robot] if robot else [])]
        process = made.start(sys.executable, *words)
        address = f"http://127.0.0.1:{port}"
        wait_until(lambda: answers(address) or process.poll() is not None, 90.0, "the stage")
        assert process.poll() is None, process.tail()
        yield address
    finally:
        made.close()


def fill(runs: Path) -> None:
    """Let these recordings be all that there are; none of them can be read."""
    shutil.rmtree(runs, ignore_errors=True)
    for name in ("a_recording_with_quite_a_long_name_2026-03-01", "to_be_renamed", "to_go"):
        (runs / name).mkdir(parents=True)
        (runs / name / "run.bag").write_bytes(b"x" * 2048)


def begin_exercise(runs: Path) -> None:
    """Let a learner have started an exercise, and have had it marked; its card is as bad as can be.

    A word that finds no place to break, a table, a hint after the other, and what is no text.
    """
    place = runs / "course" / "ada" / "e09_x"
    place.mkdir(parents=True, exist_ok=True)
    (place / "card.md").write_text(CARD, encoding="utf-8")
    (place / "answers.yaml").write_text("answers: {a: {x_mm: 1, y_mm: }}\n", encoding="utf-8")
    reason = {"passed": False, "reason": "a: x_mm = 1 is not within 0.1 of <b>the right value</b>"}
    result = {"number": 1, "time": 1.0, "learner": "ada", "exercise": "e09_x", "title": "t"}
    result |= {**reason, "evidence": "answers.yaml", "digest": "d", "signature": "s"}
    (runs / "course" / "results.jsonl").write_text(json.dumps(result) + "\n", encoding="utf-8")
    started = {"exercise": "e09_x", "title": "9. Teach a pallet, with <i>care</i>", "exercises": 12}
    # What is there now is read by the page: this one comes last.
    (place.parent / "started.json").write_text(json.dumps(started), encoding="utf-8")


def at_sizes(*each_time: str) -> pytest.MarkDecorator:
    """Return the sizes at which a test is played: these each time, all others by night.

    test_for_hands.py measures each size each time, so that no layout goes unseen by day.
    """
    others = thorough(*(size for size in SIZES if size not in each_time))
    return pytest.mark.parametrize("size", [*each_time, *others])


def until(page: Page, condition: str, given: Any = None) -> None:
    """Wait until a function of the page says yes.

    For what is waited for often: at each look in vain Playwright's ``expect`` writes down the whole
    page, which stands still for 35 to 70 ms meanwhile.

    Raises:
        AssertionError: It has not within ``PATIENCE_MS``.
    """
    try:
        page.wait_for_function(condition, arg=given, polling=LOOK_MS, timeout=PATIENCE_MS)
    except TimeoutError as error:
        seen = page.locator("body").inner_text()
        raise AssertionError(f"in vain: {condition} of {given}; the page:\n{seen}") from error


def answers(address: str) -> bool:
    """Return whether a server answers there."""
    try:
        with urllib.request.urlopen(f"{address}/events.csv", timeout=5.0):
            return True
    except OSError:
        return False
