"""The wall of the desk's page: cards stand still, a STOP is its cell's, equal alarms are one."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from harness.machines.made_farm import MadeFarm
from harness.page.theatre import MEASURE, until
from harness.running.thorough import SEARCH, thorough
from harness.wires.browser import kept_chromium
from playwright.sync_api import Browser, Page, Route, expect
from ros.farm.conftest import Farm
from scara_ros.page.page_words import MODES

SIZES = [(390, 844), (820, 1180), (1280, 800), (1920, 1080)]
CELLS = 20
LOOKS_S = 1 if SEARCH else 3
"""Between two looks at all places; what comes and goes stays for longer."""
BEGIN = 1_780_000_050.0  # invented cells are ready half a minute later
# All that must stand still, in the document: cards, their buttons, those of alarms, and the bar's.
PLACES = """() => [...document.querySelectorAll(
    ".cell, .cell button, .alarm, .alarm-buttons button, .bar, .bar-all button, .clock, .card")]
    .map((place) => { const box = place.getBoundingClientRect();
        const of = place.closest("[data-cell]")?.dataset.cell ?? "";
        return [`${place.className.replace(/ is-(hidden|gone)/, "")} ${of}`, box.left,
            box.top + (place.closest(".bar") ? 0 : scrollY), box.width, box.height]; })
"""
SHOWN = """(clock) => document.querySelector("#clock").textContent === clock"""
STATUSES = """() => Object.fromEntries([...document.querySelectorAll(".cell")].map(
    (card) => [card.dataset.cell, card.querySelector(".cell-title").textContent]))"""


class MadeWall:
    """A page of a desk whose cells are made, at times that the test sets."""

    def __init__(self, page: Page, farm: Farm) -> None:
        """Open the page; from then on its clock stands."""
        self.page, self.made, self.now = page, MadeFarm(range(CELLS), BEGIN), BEGIN
        page.route("**/farm/wall", self._answer)
        page.goto(farm.opened)
        expect(page.locator(".cell")).to_have_count(CELLS)
        page.clock.install(time=BEGIN)

    def _answer(self, route: Route) -> None:
        wall = msgspec.json.encode(self.made.at(self.now))
        route.fulfill(body=wall, content_type="application/json")

    def go_on(self, seconds: float = 1.0) -> None:
        """Let time pass, and wait until the page shows what is then."""
        self.now += seconds
        self.page.clock.run_for(1000)
        shown = time.strftime("%H:%M:%S", time.localtime(self.now))
        until(self.page, SHOWN, shown)

    def places(self) -> dict[Any, list[float]]:
        """Return where everything stands."""
        found: list[list[Any]] = self.page.evaluate(PLACES)
        kinds: Counter[str] = Counter()
        places = {}
        for kind, *place in found:
            places[kind, kinds[kind]] = place
            kinds[kind] += 1
        return places

    def statuses(self) -> dict[str, str]:
        """Return what each card says of its cell."""
        found: dict[str, str] = self.page.evaluate(STATUSES)
        return found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    """Give all tests a desk that serves its page."""
    farm = Farm(tmp_path_factory.mktemp("served"))
    farm.desk()
    yield farm
    farm.stage.close()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Give all tests a browser."""
    with kept_chromium() as made:
        yield made


def opened(browser: Browser, farm: Farm, size: tuple[int, int]) -> MadeWall:
    """Open the page of made cells."""
    width, height = size
    return MadeWall(browser.new_page(viewport={"width": width, "height": height}), farm)


@pytest.mark.parametrize("size", [SIZES[0], *thorough(*((size,) for size in SIZES[1:]))])
def test_no_card_changes_its_place_by_itself_in_a_minute(
    served: Farm, browser: Browser, size: tuple[int, int]
) -> None:
    """0 px while cells stop, are lost and come back: the finger's STOP stays.

    In each layout of the page, by night.
    """
    wall = opened(browser, served, size)
    wall.made.alarm(range(3), "stands", wall.now)
    wall.made.alarm(range(5, 6), "is hot", wall.now, "drive")
    wall.go_on()
    before, seen = wall.places(), [wall.statuses()]
    assert sum(name.startswith("cell ") for name, _ in before) == CELLS
    for second in range(0, 60, LOOKS_S):
        if second - LOOKS_S < 20 <= second:
            wall.made.alarm(range(3, 9), "stands", wall.now)
        if second - LOOKS_S < 40 <= second:
            wall.made.clear(range(9), wall.now)
        wall.go_on(LOOKS_S)
        places = wall.places()
        moved = [(k, before[k], at) for k, at in places.items() if at != before.get(k, at)]
        assert moved == [] and len(places) >= len(before) - 1, second
        seen.append(wall.statuses())
    assert len({tuple(sorted(each.items())) for each in seen}) > 5, "too little happened"
    titles = {title for each in seen for title in each.values()}
    assert {"Lost", "Stopped", "Paused", "Emergency stop", "Ready", "Offline"} <= titles
    assert titles <= {title for title, _ in MODES.values()} | {"Lost", "Starting"}
    wall.page.close()


def test_all_can_be_touched_and_read_at_four_sizes_light_and_dark(
    served: Farm, browser: Browser
) -> None:
    """44 px to touch, 14 px to read, nothing cut or covered, WCAG AA; no page scrolls sideways."""
    found = []
    wall = opened(browser, served, SIZES[0])
    wall.made.alarm(range(12), "stands", wall.now)
    for width, height in SIZES:
        wall.page.set_viewport_size({"width": width, "height": height})
        for colours in ("light", "dark"):
            wall.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
            wall.go_on(14.0)  # other cells are stopped, lost or back
            problems = wall.page.evaluate(MEASURE)
            found += [f"{width} x {height} {colours}: {text}" for text in problems]
    wall.page.close()
    assert found == []


def test_a_new_cell_comes_last_and_one_that_goes_leaves_its_place(
    served: Farm, browser: Browser
) -> None:
    """Until the page is loaded again."""
    wall = opened(browser, served, (1280, 800))
    wall.go_on()
    before = wall.places()
    wall.made = MadeFarm(range(1, CELLS + 1), BEGIN)
    wall.made.unreadable = 3
    wall.go_on()
    expect(wall.page.locator("#summary")).to_contain_text("3 messages could not be read")
    names = wall.page.locator(".cell-name").all_text_contents()
    assert names == [f"made_up_{k:03d}" for k in range(CELLS + 1)]
    assert wall.statuses()["practice/made_up_000"] == "Gone"
    cells = [key for key in before if key[0].startswith(("cell ", "button "))]
    assert [key for key in cells if wall.places()[key] != before[key]] == []
