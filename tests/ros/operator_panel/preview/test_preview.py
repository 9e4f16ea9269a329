"""A motion is looked at before it is made: the place for it, at four sizes, light and dark."""

from __future__ import annotations

import re

from harness.page.acts import preview_of
from harness.page.theatre import Theatre, at_sizes
from playwright.sync_api import expect


@at_sizes("phone")
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


AIMS = """() => {
    const aim = window.panel.preview;
    window.aimed = [];
    window.panel.preview = (pose) => { aim(pose); window.aimed.push(pose); };
}"""


def test_answer_about_a_typed_position_leaves_a_preview_that_came_before_it(
    theatre: Theatre,
) -> None:
    """The answer is late; only what is typed after the preview was opened closes it."""
    page = theatre.page
    theatre.resize("low")
    theatre.play("ready")
    theatre.open("Target")
    page.get_by_role("button", name="Clear", exact=True).click()
    page.evaluate(AIMS)
    page.request.get(f"{theatre.address}/answers/hold")
    try:
        for axis in "XYZ":
            page.get_by_label(axis, exact=True).fill("200")
        page.get_by_role("button", name="Preview Move").click()
        preview_of(page, "part_3 in hand would hit stand_1")
    finally:
        page.request.get(f"{theatre.address}/answers/give")
    page.wait_for_function("() => window.aimed.some((pose) => pose !== null)")
    expect(page.locator(".preview").first).to_contain_text("Reachable")
    expect(page.locator("[data-motion]")).to_be_visible()
    page.get_by_label("X", exact=True).fill("210")
    expect(page.locator("[data-motion]")).to_be_hidden()


def test_verdict_that_comes_after_its_preview_was_closed_opens_none(theatre: Theatre) -> None:
    """Nor one about another motion than the one that was asked for last."""
    page = theatre.page
    theatre.resize("low")
    theatre.play("ready")
    late = "{title: 'Home', sentence: 'late', tone: 'good', times: []}"
    page.evaluate("window.panel.judging('Home')")
    page.locator("[data-motion-close]").click()
    page.evaluate(f"window.panel.judged({late})")
    expect(page.locator("[data-motion]")).to_be_hidden()
    page.evaluate("window.panel.judging('Move')")
    page.evaluate(f"window.panel.judged({late})")
    expect(page.locator("[data-motion-words]")).to_have_text("Move: judging ...")
    page.locator("[data-motion-close]").click()
