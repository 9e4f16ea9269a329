"""What a cell shows at its first start, with nothing set up but what it needs itself."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from harness.page.acts import TOKEN, cell_with_pages, preview_of
from harness.wires.browser import chromium
from playwright.sync_api import expect

pytestmark = pytest.mark.system

MINUTE_S = 60.0


def test_preview_of_article_plays_in_the_first_minute(tmp_path: Path) -> None:
    """Start, page, button, verdict and ghost, without another command in between."""
    begun = time.monotonic()
    with (
        cell_with_pages(tmp_path, timeout=MINUTE_S) as (_, _, port),
        chromium(tmp_path) as browser,
    ):
        page = browser.new_page()
        page.set_default_timeout(1e3 * (begun + MINUTE_S - time.monotonic()))
        page.goto(f"http://127.0.0.1:{port}/?token={TOKEN}")
        page.get_by_role("tab", name="Programs", exact=True).click()
        page.get_by_role("button", name="Preview ARTICLE").click()
        preview_of(page, re.compile("Program ARTICLE: OK"))
        slider = page.locator("[data-motion-range]")
        first = slider.input_value()
        expect(slider).not_to_have_value(first)
    assert time.monotonic() - begun < MINUTE_S
