"""The place over the picture where a judged motion is played: verdict, curves, time."""

from __future__ import annotations

from nicegui import ui

from operator_panel.page.view_io import live, plain

CURVES = {"clearance": "Clearance", "speed": "Tool speed"}


def build_motion_line() -> None:
    """Build the place; the browser shows it while a motion is looked at."""
    with (
        ui.element("section")
        .classes("motion-line")
        .props('data-motion hidden aria-label="Preview"')
    ):
        ui.element("p").classes("motion-words").props(
            'data-motion-words tabindex=0 aria-live="polite"'
        )
        with ui.element("div").classes("motion-curves").props("data-motion-curves"):
            for name, title in CURVES.items():
                with ui.element("div").classes(f"motion-curve motion-{name}"):
                    with ui.element("span").classes("motion-name"):
                        plain(f"{title} ")
                        ui.element("span").props(f'data-motion-now="{name}"').classes("live")
                    plain(_drawing(name), "motion-drawing", "div")
        with ui.element("div").classes("motion-time"):
            with ui.element("button").props("type=button data-motion-play"):
                plain("Play")
            ui.element("input").classes("motion-range").props(
                'data-motion-range type=range min=0 max=1 step=any value=0 aria-label="Time of it"'
            )
            ui.element("span").props("data-motion-at").classes("num")
            with ui.element("button").props("type=button data-motion-close"):
                plain("Close")


def build_gate_line() -> None:
    """Build what the gate does with a motion now, and how well the last one was predicted."""
    live("gate", "gate-line", "p").props('data-tone="gate"')
    live("made", "made-line", "p")


def _drawing(name: str) -> str:
    """Return an empty drawing: the curve, where something is wrong, and now."""
    return (
        f'<svg data-motion-curve="{name}" viewBox="0 0 100 30" preserveAspectRatio="none" '
        'aria-hidden="true"><path></path><line class="wrong" y1="0" y2="30"></line>'
        '<line class="now" y1="0" y2="30"></line></svg>'
    )
