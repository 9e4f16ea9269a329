"""A hand at the operator's page: it uses controls, and remembers which ones it has not used."""

from __future__ import annotations

from playwright.sync_api import Locator, expect

from harness.page.theatre import STAGE, Theatre, until

TOUCHED = (STAGE.parent / "touched.js").read_text(encoding="utf-8")

ACCEPTED = ("running", "done")
"""Outcomes of a motion that the cell has begun: a page calls it done a second later at the earliest
where nothing moves, as on a stage."""
# Whether the newest command of these words is shown, with one of these outcomes if there are any.
TOLD = """([words, outcomes]) => {
    const lines = [...document.querySelectorAll("[data-command]")];
    const line = lines.find((one) => one.textContent.toLowerCase().includes(words));
    return line?.checkVisibility() && (!outcomes.length || outcomes.includes(line.dataset.outcome));
}"""
# Which stops a finger would miss: something lies on them, or they are not on the screen.
COVERED = """() => [...document.querySelectorAll("[data-stop]")].filter((button) => {
    const { left, top, width, height } = button.getBoundingClientRect();
    return !button.contains(document.elementFromPoint(left + width / 2, top + height / 2));
}).map((button) => button.dataset.stop)"""


class Hand:
    """Clicks what a person would click; each click has an effect that can be seen."""

    def __init__(self, theatre: Theatre) -> None:
        """Begin to note what is shown and what is touched."""
        self.theatre, self.page = theatre, theatre.page
        self.page.evaluate(TOUCHED)

    def button(self, name: str, within: Locator | None = None) -> Locator:
        """Return the button that is shown under this name."""
        place = self.page if within is None else within
        return place.get_by_role("button", name=name, exact=True).locator("visible=true")

    def panel(self, tab: str) -> Locator:
        """Open a tab; return its panel."""
        self.choose(self.page.get_by_role("tab", name=tab, exact=True))
        return self.page.locator(f'[data-panel="{tab}"]')

    def look(self) -> None:
        """Note what is shown now; whatever it is, a finger reaches both stops."""
        self.page.evaluate("controls.look()")
        assert self.page.evaluate(COVERED) == []

    def choose(self, tab: Locator) -> None:
        """Choose one of several; it is the chosen one then."""
        tab.click()
        expect(tab).to_have_attribute("aria-selected", "true")
        self.look()

    def switch(self, button: Locator) -> None:
        """Press a button that stays pressed, and once more."""
        for pressed in ("true", "false"):
            button.click()
            expect(button).to_have_attribute("aria-pressed", pressed)

    def command(self, button: Locator, told: str, *outcomes: str) -> None:
        """Press a button that sends a command; the place of the commands tells of it."""
        button.click()
        until(self.page, TOLD, [told.lower(), outcomes])

    def slide(self, slider: Locator, shown: Locator) -> None:
        """Move a slider; its number changes."""
        before = shown.inner_text()
        slider.click(position={"x": 30, "y": 5})
        expect(shown).not_to_have_text(before)

    def judged(self, plays: bool = False) -> None:
        """Close the place where a judged motion is shown, or play the motion there before."""
        place = self.page.locator("[data-motion]")
        play = place.locator("[data-motion-play]")
        expect(play).to_be_visible()
        self.look()
        if plays:
            play.click()
            place.locator("[data-motion-range]").click(position={"x": 20, "y": 10})
            expect(play).to_have_text("Play")
        place.locator("[data-motion-close]").click()
        expect(place).to_be_hidden()

    def left(self) -> list[str]:
        """Return all controls that were shown and not used."""
        self.look()
        found: list[str] = self.page.evaluate("controls.left()")
        return found
