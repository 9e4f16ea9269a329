"""The tool jogged by a held button of the operator's page, on a whole cell."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from harness.page.acts import LONG_MS, hold_until, is_mode, press
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.system
MINUS = "\N{MINUS SIGN}"


def test_held_tool_goes_straight_with_both_and_stops_by_release(
    operator: Page, open_page: Callable[..., Page]
) -> None:
    """Along x of the world, by all joints together; the real robot follows."""
    watcher = open_page("")
    operator.get_by_role("tab", name="Target").click()
    operator.get_by_role("button", name="P2", exact=True).click()
    expect(operator.locator(".preview.good")).to_be_visible()
    press(operator, "Move")
    told = operator.locator("[data-command]", has_text="Move to x").first
    expect(told).to_have_attribute("data-outcome", "done", timeout=LONG_MS)
    operator.get_by_role("tab", name="Jog").click()
    operator.get_by_role("tab", name="Hold tool").click()
    operator.get_by_role("tab", name="Fast").click()
    before = tool_of(watcher, "twin")
    button = operator.get_by_role("button", name=f"Jog X {MINUS}")
    expect(button).to_be_enabled()
    hold_until(operator, button, lambda: tool_of(watcher, "twin")[0] < before[0] - 15.0)
    operator.mouse.up()
    expect(watcher.locator('[data-live="motion"]')).to_have_text("both stand still")
    is_mode(watcher, "Ready", LONG_MS)
    twin, real = tool_of(watcher, "twin"), tool_of(watcher, "real")
    assert twin[0] < before[0] - 15.0 and twin[2] == pytest.approx(before[2], abs=0.5)
    assert twin[1] == pytest.approx(before[1], abs=2.0), "it keeps to its line"
    assert real == pytest.approx(twin, abs=0.5)


def tool_of(page: Page, side: str) -> list[float]:
    """Return where a side's tool is [mm]."""
    text = page.locator(f'[data-live="tool.{side}"]').inner_text().replace(MINUS, "-")
    return [float(number) for number in re.findall(r"-?\d+\.\d", text)]
