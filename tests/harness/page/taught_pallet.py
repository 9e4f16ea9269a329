"""The job of PALLETISE as a person teaches it on the operator's page, each action counted."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

PICKS = """\
310.643 0 -9.5 180
335.393 -14.289 -9.5 180
335.393 14.289 -9.5 180
450.643 -160 -9.5 180
475.393 -174.289 -9.5 180
475.393 -145.711 -9.5 180
450.643 160 -9.5 180
475.393 145.711 -9.5 180
475.393 174.289 -9.5 180"""
"""Half a millimetre above the parts [mm], with the table turned half round [deg]."""
CORNER = "-10 -510 -19.2 180"
"""Of the pallet: a part that is set down here is let go 0.3 mm above it."""
GRID = {"Rows": "3", "Columns": "3", "Pitch x": "60", "Pitch y": "60"}
PICK_LINES, ALL_LINES = 10, 18
PANEL = '[data-panel="Teach"]'


class Actions:
    """What a person does on tab Teach, counted."""

    def __init__(self, page: Page, between: Callable[[], None] = lambda: None) -> None:
        """Begin at 0; ``between`` is done behind each action."""
        self.count, self._page, self._between = 0, page, between

    def click(self, role: str, name: str) -> None:
        """Press something once it may be pressed."""
        made = self._page.get_by_role(role, name=name, exact=True)  # type: ignore[arg-type]
        expect(made.locator("visible=true")).to_be_enabled()
        made.locator("visible=true").click()
        self._done()

    def fill(self, label: str, text: str) -> None:
        """Fill a field."""
        self._page.locator(PANEL).get_by_label(label, exact=True).fill(text)
        self._done()

    def type_line(self, label: str, text: str) -> None:
        """Type one more line into a field."""
        field = self._page.locator(PANEL).get_by_label(label, exact=True)
        field.focus()
        self._page.keyboard.press("Control+End")
        field.press_sequentially(f"{text}\n")
        self._done()

    def _done(self) -> None:
        self.count += 1
        self._between()


def teach_pallet(actions: Actions, page: Page) -> None:
    """Teach nine parts from their stands to the pallet, from an empty draft."""
    rows, said = page.locator("[data-teach-line]"), page.locator(".teach-said")
    actions.click("tab", "Teach")
    for line in PICKS.splitlines():
        actions.type_line("Places", line)
    actions.click("button", "Pick")
    expect(rows).to_have_count(1 + PICK_LINES)
    actions.type_line("Places", CORNER)
    for name, text in GRID.items():
        actions.fill(name, text)
    actions.click("button", "Grid")
    expect(said).to_have_text("9 places, all within reach.")
    actions.click("button", "Place")
    expect(rows).to_have_count(1 + ALL_LINES)
