"""The page of a report in a real browser: on a phone and on a large screen nothing is cut off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from harness.running.thorough import thorough
from harness.wires.browser import kept_chromium
from harness.workspace import ROOT
from playwright.sync_api import Browser
from twin_experiments.report.report_io import write_report

MakeBag = Callable[..., Path]
TOO_WIDE = """() => [document.documentElement, ...document.querySelectorAll(".scroll, figure, td")]
    .filter((one) => one.scrollWidth > one.clientWidth + 1)
    .map((one) => `${one.tagName} ${one.className} ${one.textContent.slice(0, 60)}`)"""
SEEN = "() => [...document.querySelectorAll('td')].filter((one) => one.offsetHeight > 0).length"
TOLD = "() => [...document.querySelectorAll('td')].filter((one) => one.textContent).length"
LONG_MS = 90_000.0
CHARTS = 3
"""Of an experiment: tools, joints' difference, joints."""


@pytest.fixture(scope="module")
def page_file(make_bag: MakeBag) -> Path:
    """Write the report of an imitated run once."""
    bag = make_bag(experiments=("real_leads",), lag_s=0.004)
    return write_report(bag, bag.parent / "out", ROOT / "config").folder / "report.html"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Give one browser to all widths."""
    with kept_chromium() as started:
        yield started


@pytest.mark.parametrize("width", [390, *thorough(768, 1280), 1920])
def test_a_report_fits_the_screen(browser: Browser, page_file: Path, width: int) -> None:
    """No table and no figure scrolls sideways, all cells that say something are seen."""
    page = browser.new_page(viewport={"width": width, "height": 844})
    page.set_default_timeout(LONG_MS)
    page.goto(page_file.as_uri())
    page.evaluate("() => document.querySelectorAll('details').forEach((one) => (one.open = true))")
    charts = page.locator(".chart")
    assert charts.count() == CHARTS
    for chart in charts.all():
        chart.scroll_into_view_if_needed()
        chart.locator("canvas").wait_for()
    assert page.evaluate(TOO_WIDE) == []
    told = page.evaluate(TOLD)
    assert page.evaluate(SEEN) >= told > 50
    page.close()
