"""What stands on the picture: who leads, how far the tools are apart, how fast the pair is."""

from __future__ import annotations

from nicegui import ui
from scara_ros.page.page_library_io import plain

from operator_panel.page.view_io import live

NAMES = {"real": "Real robot", "twin": "Twin"}
"""Names of the sides; their colours are those of both robots in the picture."""


def build_lead() -> None:
    """Build both robots with what each does, an arrow to the follower, and the program's line."""
    with ui.element("section").classes("lead-card").props('data-tone="lead"'):
        with ui.element("div").classes("lead"):
            _side("real")
            live("lead.arrow", "lead-arrow")
            _side("twin")
        live("robot.program", "lead-program")


def _side(side: str) -> None:
    with ui.element("div").classes(f"lead-side lead-{side}"):
        plain(NAMES[side], "lead-name")
        live(f"lead.{side}", "lead-role")


def build_apart() -> None:
    """Build the tools' distance, beside the distance that raises an alarm, and the speed."""
    with ui.element("section").classes("deviation-card"):
        with ui.element("div").classes("apart"):
            live("deviation", "apart-number num").props('data-tone="deviation"')
            plain("apart", "fact-title")
            ui.element("span").classes("magnified").props("data-magnified")
            with ui.element("div").classes("gauge").props('data-gauge="deviation"'):
                ui.element("i").classes("gauge-fill")
            with ui.element("div").classes("gauge-words"):
                live("lag")
                live("deviation.limit")
        live("speed.applied", "apart-number num").props('data-tone="speed.applied"')
