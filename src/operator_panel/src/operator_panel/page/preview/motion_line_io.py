"""The place over the picture where a judged motion is played: verdict, curves, time."""

from __future__ import annotations

from nicegui import ui
from scara_ros.page.page_library_io import button_of, plain

from operator_panel.page.view_io import live

CURVES = {"clearance": "Clearance", "speed": "Tool speed"}
DRAWING = """<svg data-motion-curve="{name}" viewBox="0 0 100 30" preserveAspectRatio="none"
aria-hidden="true"><path></path><line class="wrong" y1="0" y2="30"></line>
<line class="now" y1="0" y2="30"></line></svg>"""


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
                    # The curve, where something is wrong, and now; the browser fills them.
                    drawing = DRAWING.format(name=name)
                    ui.html(drawing, sanitize=False, tag="div").classes("motion-drawing")
        with ui.element("div").classes("motion-time"):
            button_of("Play", props="data-motion-play")
            ui.element("input").classes("motion-range").props(
                'data-motion-range type=range min=0 max=1 step=any value=0 aria-label="Time of it"'
            )
            ui.element("span").props("data-motion-at").classes("num")
            button_of("Close", props="data-motion-close")


def build_gate_line() -> None:
    """Build what the gate does with a motion now, and how well the last one was predicted."""
    live("gate", "gate-line", "p").props('data-tone="gate"')
    live("made", "made-line", "p")
