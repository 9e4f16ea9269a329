"""The real robot itself: operating mode, drives, stop; put the parts back."""

from __future__ import annotations

from nicegui import ui
from scara_ros.page.page_library_io import plain

from operator_panel.page.view_io import PageView, live, push_button
from operator_panel.page.work.frames_io import build_frames
from operator_panel.page.work.registers_io import build_registers

FACTS = (
    ("Operating mode", "status.mode"),
    ("Drives", "status.drives"),
    ("Emergency stop", "status.stop"),
    ("Motion", "status.motion"),
    ("Error", "status.error"),
    ("Program", "robot.program"),
)
TODAY = (
    ("Ran to the end", "today.cycles"),
    ("Now", "today.running"),
    ("Last program", "today.last"),
    ("Mean of the last 20", "today.mean"),
    ("Parts placed", "today.parts"),
    ("Tools furthest apart", "today.deviation"),
)


def build_robot(view: PageView) -> None:
    """Build what the robot says of itself, and the button for the parts."""
    facts(FACTS)
    with ui.element("div").classes("row-line"):
        plain("Parts", "field-title")
        if view.around.has_parts:
            _parts_back(view)
            plain("of both cells, where they stood at the start", "row-text")
        else:
            plain("this robot has none", "row-text")
    build_frames(view)
    with ui.element("div").classes("hint"):
        plain("Who may move the robot is chosen at the robot, by its mode switch.")
    build_registers(view)


def facts(places: tuple[tuple[str, str], ...]) -> None:
    """Build a list of names and what is true now."""
    with ui.element("dl").classes("fact-list"):
        for title, key in places:
            plain(title, "fact-title", "dt")
            live(key, "fact-value", "dd")


def _parts_back(view: PageView) -> None:
    async def press() -> None:
        dialog.close()
        await view.act("PARTS", "Put parts back", view.door.put_parts_back)

    with ui.dialog() as dialog, ui.element("div").classes("card confirm"):
        plain("Put all parts back?", "confirm-title", "h2")
        plain("They stand where they stood at the start. Nothing moves.", "", "p")
        with ui.element("div").classes("row-line"):
            push_button("Cancel", dialog.close, props="autofocus")
            view.button("Put back", "MOVE", "primary", press).mark("parts-back-confirmed")
    view.button("Put back", "MOVE", "", dialog.open).mark("parts-back")


def build_today(_: PageView) -> None:
    """Build the list; its values come with each frame."""
    facts(TODAY)
    with ui.element("div").classes("hint"):
        plain("Counted since midnight, or since the page's server was started.")
