"""What the pair has done since midnight."""

from __future__ import annotations

from nicegui import ui

from operator_panel.io.page.view import PageView, plain
from operator_panel.io.page.work.robot import facts

FACTS = (
    ("Ran to the end", "today.cycles"),
    ("Now", "today.running"),
    ("Last program", "today.last"),
    ("Mean of the last 20", "today.mean"),
    ("Parts placed", "today.parts"),
    ("Tools furthest apart", "today.deviation"),
)


def build_today(_: PageView) -> None:
    """Build the list; its values come with each frame."""
    facts(FACTS)
    with ui.element("div").classes("hint"):
        plain("Counted since midnight, or since the page's server was started.")
