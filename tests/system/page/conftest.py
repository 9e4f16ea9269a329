"""A patient cell, and the operator's page on it in a real browser."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from harness.live_cell import LiveCell
from harness.page.acts import (
    TOKEN,
    Panel,
    make_ready,
    patient_configuration,
    take_control,
)
from harness.wires.browser import LOAD_MS, chromium
from playwright.sync_api import Browser, Page, expect


@pytest.fixture(scope="module")
def patient_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready cell with patient time-outs and gains of its own to change."""
    cell = LiveCell(tmp_path_factory.mktemp("cell"))
    config = patient_configuration(cell.folder / "patient")
    # Page and controller know the same token of the person.
    with cell.ready(config=config, env={"OPERATOR_PANEL_TOKEN": TOKEN}):
        yield cell


@pytest.fixture(scope="module")
def panel(patient_cell: LiveCell) -> Iterator[Panel]:
    """Give a running panel."""
    made = Panel(patient_cell)
    made.start()
    yield made
    if made.process is not None and made.process.poll() is None:
        assert made.stop() == 0


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Give one browser to all tests of this file."""
    with chromium(tmp_path_factory.mktemp("browser")) as started:
        yield started


class Pages:
    """The pages of one panel in one browser."""

    def __init__(self, browser: Browser, panel: Panel) -> None:
        """Open none yet."""
        self.address = f"http://127.0.0.1:{panel.port}/"
        self.asked: set[str] = set()
        """Who was asked for something by a page: host and port."""
        self._browser = browser
        self._kept: dict[str, Page] = {}

    def open(self, token: str = TOKEN) -> Page:
        """Open the page in a context of its own, as another browser would; empty: without token."""
        context = self._browser.new_context(viewport={"width": 1280, "height": 720})
        page = context.new_page()
        page.on("request", lambda request: self.asked.add(request.url.split("/")[2]))
        page.goto(self.address + (f"?token={token}" if token else ""), timeout=LOAD_MS)
        expect(page.locator("[data-panel].shown")).to_be_visible(timeout=LOAD_MS)
        page.wait_for_function("() => window.did_handshake")  # else NiceGUI may load it again
        return page

    def kept(self, token: str) -> Page:
        """Give the page that the tests share: a page takes four seconds to load."""
        page = self._kept.get(token)
        if page is None or page.is_closed():
            page = self._kept[token] = self.open(token)
        return page

    def texts(self) -> str:
        """Return what stands on all open pages."""
        pages = (page for context in self._browser.contexts for page in context.pages)
        return "\n\n".join(page.locator("body").inner_text() for page in pages)


@pytest.fixture(scope="module")
def pages(browser: Browser, panel: Panel) -> Iterator[Pages]:
    """Give the pages of all tests of this file; none asks another machine for anything."""
    made = Pages(browser, panel)
    yield made
    assert {f"http://{host}/" for host in made.asked} == {made.address}


@pytest.fixture
def viewer(pages: Pages) -> Page:
    """Give the page of one who only watches."""
    return pages.kept("")


@pytest.fixture
def operator(pages: Pages) -> Page:
    """Give the page of an operator in control, with the pair ready."""
    page = pages.kept(TOKEN)
    # A page that was closed gives control back after a while.
    expect(page.locator(".control-text")).to_have_text(re.compile("Nobody is|: in control"))
    take_control(page)
    make_ready(page)
    return page


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Show what stood on the pages where a test failed."""
    report = yield
    pages = getattr(item, "funcargs", {}).get("pages")
    if report.when == "call" and report.failed and pages is not None:
        report.sections.append(("pages", pages.texts()))
    return report
