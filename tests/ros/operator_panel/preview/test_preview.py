"""A motion is looked at before it is made: the place for it, at four sizes, light and dark."""

from __future__ import annotations

import re

import pytest
from harness.page.acts import preview_of
from harness.page.theatre import SIZES, Theatre
from playwright.sync_api import expect


@pytest.mark.parametrize("size", SIZES)
def test_preview_can_be_read_and_touched_and_moves_nothing_else(
    theatre: Theatre, size: str
) -> None:
    """The longest words, light and dark; everything else stays where it was, to the pixel."""
    theatre.resize(size)
    theatre.play("ready")
    theatre.open("Programs")
    theatre.settle()
    before, found = theatre.places(), []
    theatre.page.get_by_role("button", name="Preview ARTICLE").click()
    preview_of(theatre.page, "part_3 in hand would hit stand_1")
    assert theatre.page.locator("[data-motion-words]").get_attribute("data-is") == "bad"
    wrong = theatre.page.locator("[data-motion-curve=clearance] .wrong")
    expect(wrong).to_have_attribute("x1", re.compile("^51.6"))  # at 0.62 of 1.2 s
    theatre.settle()
    assert theatre.places() == before
    for colours in ("light", "dark"):
        theatre.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
        found += theatre.problems(f"{size}, {colours}, preview")
    theatre.page.locator("[data-motion-close]").click()
    expect(theatre.page.locator("[data-motion]")).to_be_hidden()
    theatre.page.get_by_role("button", name="Run", exact=True).first.click()
    dialog = theatre.page.get_by_role("dialog")
    expect(dialog.locator(".verdict")).to_contain_text("would hit")
    expect(dialog.get_by_role("button", name=re.compile("^Run "))).to_have_count(0)
    # The question lies over the whole page.
    cut = theatre.problems(f"{size}, the question before RUN")
    found += [text for text in cut if ": overlap: " not in text]
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)
    assert found == []
