"""A patient cell, and the operator's page on it in a real browser."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest
from harness.live_cell import LiveCell
from harness.page.acts import (
    TOKEN,
    Panel,
    make_ready,
    patient_configuration,
    take_control,
)
from harness.wires.browser import chromium
from harness.yaml_files import changed_yaml
from playwright.sync_api import Browser, Page, expect

DIVERGENCE: list[tuple[list[str | int], float]] = [
    (["divergence", "path_mm"], 200.0),
    (["divergence", "rest_mm"], 50.0),
]


@pytest.fixture(scope="module")
def patient_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready cell with patient time-outs and gains of its own to change."""
    cell = LiveCell(tmp_path_factory.mktemp("cell"))
    config = patient_configuration(cell.folder / "patient")
    for path, value in DIVERGENCE:
        changed_yaml(config / "twin_controller.yaml", config, path, value)
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


@pytest.fixture
def open_page(browser: Browser, panel: Panel) -> Iterator[Callable[..., Page]]:
    """Give a function that opens the page in a browser of its own.

    Nothing may be asked of another machine.
    """
    contexts = []

    def open_one(token: str = TOKEN) -> Page:
        context = browser.new_context(viewport={"width": 1280, "height": 720})
        contexts.append(context)
        page = context.new_page()
        page.on("request", lambda request: asked.add(request.url.split("/")[2]))
        page.goto(f"http://127.0.0.1:{panel.port}/" + (f"?token={token}" if token else ""))
        expect(page.locator("[data-panel].shown")).to_be_visible()
        return page

    asked: set[str] = set()
    yield open_one
    for context in contexts:
        for page in context.pages:
            print(page.locator("body").inner_text())  # pytest shows it where a test failed
        context.close()
    assert asked == {f"127.0.0.1:{panel.port}"}


@pytest.fixture
def operator(open_page: Callable[..., Page]) -> Page:
    """Give the page of an operator in control, with the pair ready."""
    page = open_page()
    expect(page.locator(".control-text")).to_have_text(re.compile("Nobody is in control"))
    take_control(page)
    make_ready(page)
    return page
