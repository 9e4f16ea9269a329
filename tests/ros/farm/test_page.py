"""The desk's page in a browser: the wall, STOP, a lost cell, alarms, figures at three widths."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import pytest
from farm.desk.io.past.fits import keep_fits
from farm.fits import DayFit
from harness.processes import Process, Stage, free_port, wait_until
from harness.wires.browser import chromium
from harness.workspace import workspace_environment

TOKEN = "token-of-the-farms-page"
DEADLINE_S = 30.0
FRICTION = "fitted friction joint_2 [N m]"


class Farm:
    """Starts programs of one farm."""

    def __init__(self, folder: Path) -> None:
        self.stage = Stage(folder, {**workspace_environment(), "FARM_DESK_TOKEN": TOKEN})
        self._router = str(free_port())

    def start(self, *words: str) -> Process:
        """Start a program."""
        return self.stage.start(sys.executable, "-m", *words, "--router-port", self._router)


@pytest.fixture
def farm(tmp_path: Path) -> Iterator[Farm]:
    """Give a test a farm; all of it is ended."""
    made = Farm(tmp_path / "processes")
    yield made
    made.stage.close()


def worn(data: Path) -> None:
    """Write fits of eight days of six cells; the friction of one has grown."""
    today = date.today()
    for ago in range(8, 0, -1):
        day = (today - timedelta(days=ago)).isoformat()
        grown = 1.5 if ago <= 2 else 1.0
        figures = [
            {FRICTION: (0.5 + 0.01 * k) * (1.0 + 0.005 * (ago % 3)) * (grown if k == 4 else 1.0)}
            for k in range(6)
        ]
        keep_fits(data, day, [DayFit("m", f"cell_{k}", day, 1, f) for k, f in enumerate(figures)])


def test_wall_shows_the_worst_first_and_stops_one_and_all(farm: Farm, tmp_path: Path) -> None:
    """As a person does it: look, press, read each cell's answer."""
    port = free_port()
    worn(tmp_path / "farm")
    desk = farm.start(
        "farm", "--person", "ann", "--folder", str(tmp_path / "farm"), "--port", str(port)
    )
    farm.start("farm.synthetic", "--cells", "3", "--events-rate", "1")
    other = farm.start("farm.synthetic", "--cells", "1", "--first", "9")
    wait_until(lambda: "?token=" in desk.output, DEADLINE_S, "the page's address")
    with chromium(tmp_path) as browser:
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        page.goto(f"http://127.0.0.1:{port}/?token={TOKEN}")

        def names() -> list[str]:
            """Return the cells as they are seen, in their order."""
            cards: list[Any] = page.evaluate(
                "[...document.querySelectorAll('.cell')]"
                ".sort((a, b) => a.style.order - b.style.order)"
                ".map((card) => [card.querySelector('h3').textContent, card.dataset.status])"
            )
            return [" ".join(card) for card in cards]

        wait_until(lambda: len(names()) == 4, DEADLINE_S, "four cells")
        page.locator("[data-command=STOP][data-cell='practice/made_up_002']").click()
        page.wait_for_selector("text=/made_up_002: STOP received/")
        wait_until(lambda: names()[0].startswith("practice/made_up_002 "), DEADLINE_S, "it")
        page.locator("[data-command=PAUSE][data-cell=all]").focus()
        page.keyboard.press("Enter")
        wait_until(
            lambda: page.locator(".answer", has_text="PAUSE received").count() == 4,
            DEADLINE_S,
            "an answer of each cell",
        )
        assert page.locator(".answer", has_text="STOP received").count() == 1
        other.signal(signal.SIGKILL)
        wait_until(
            lambda: names()[0] == "practice/made_up_009 lost", DEADLINE_S, "the lost cell on top"
        )
        wait_until(lambda: page.locator(".event").count() > 0, DEADLINE_S, "events of the journals")
        lost = page.locator(".alarm", has_text="made_up_009: link")
        wait_until(lambda: lost.count() == 1, DEADLINE_S, "the alarm of the lost cell")
        lost.get_by_role("button", name="Acknowledge").click()
        wait_until(
            lambda: lost.get_attribute("data-status") == "acknowledged", DEADLINE_S, "the look"
        )
        fan = page.locator(".alarm", has_text="made_up_000: real")
        page.once("dialog", lambda dialog: dialog.accept("a spare part comes"))
        fan.get_by_role("button", name="Shelve").click()
        wait_until(lambda: fan.get_attribute("data-status") == "shelved", DEADLINE_S, "the shelf")
        assert "a spare part comes" in fan.inner_text()
        page.reload()
        wait_until(lambda: page.locator(".figures .all-cells").count() == 1, DEADLINE_S, "figures")
        assert page.locator("#causes li").count() >= 1
        # Packed once for all pages, not once more for each.
        for kind, packed in (("gzip", "gzip"), ("identity", None)):
            wall = page.request.get(
                f"http://127.0.0.1:{port}/farm/wall", headers={"accept-encoding": kind}
            )
            assert wall.headers.get("content-encoding") == packed and wall.json()["cells"]
        away = page.locator("#drift-picture .away")
        wait_until(lambda: away.count() == 1, DEADLINE_S, "the picture of all cells")
        assert page.locator("#drift-picture .steady").count() == 5
        assert page.locator("#drift-picture .name").text_content() == "m/cell_4"
        assert "m/cell_4: fitted friction joint_2" in page.locator("#drifts").inner_text()
        page.get_by_label("compared with").select_option("practice/made_up_001")
        page.get_by_label("time", exact=True).select_option("12h")
        page.get_by_role("button", name="Compare").click()
        page.wait_for_selector("#compared >> text=parts placed")
        for width, height in ((1600, 900), (1280, 720), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            wide = "document.documentElement.scrollWidth <= innerWidth"
            held = "((e) => e.scrollWidth <= e.clientWidth)(document.getElementById('kpi'))"
            assert page.evaluate(wide) and page.evaluate(held), width
            if pictures := os.environ.get("FARM_PICTURES"):
                page.screenshot(path=f"{pictures}/farm_{width}.png", full_page=True)
        page.set_viewport_size({"width": 1600, "height": 900})
        desk.signal(signal.SIGKILL)
        page.wait_for_selector("#banner:has-text('The desk does not answer')")
