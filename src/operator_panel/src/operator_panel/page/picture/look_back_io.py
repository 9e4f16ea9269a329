"""The time line: the last ten minutes, or a recording, looked at again on the same page."""

from __future__ import annotations

from nicegui import ui
from scara_ros.page.page_library_io import PLAIN_BUTTON, button_of

STEPS = (("\N{MINUS SIGN}10 s", -10), ("\N{MINUS SIGN}1 s", -1), ("+1 s", 1), ("+10 s", 10))


def build_look_back_button() -> None:
    """Build the button that opens and closes the time line."""
    button_of("Look back", "look-back-button", "data-look-back aria-pressed=false")


def build_time_line() -> None:
    """Build the time line; the browser shows it below the picture and asks for moments."""
    with ui.element("div").classes("time-line").props("data-time-line hidden"):
        ui.element("input").classes("time-line-range").props(
            'data-past-range type=range min=-600 max=0 step=0.5 value=0 aria-label="Time"'
        )
        with ui.element("div").classes("time-line-steps"):
            for text, seconds in STEPS:
                button_of(text, props=f'data-past-step="{seconds}"')
            ui.element("input").classes("time-line-clock").props(
                'data-past-clock type=text autocomplete=off placeholder="14:03" '
                'aria-label="Time of day"'
            )
            button_of("Go", props="data-past-go")


def build_past_note() -> None:
    """Build what stands in the bar all the time while the page shows something that is not now.

    It takes the place of the reason, which is of that moment; the newest command stays below it.
    """
    with ui.element("div").classes("past-note").props('role="status"'):
        with ui.element("p").classes("past-note-text"):
            ui.element("span").props("data-past-text")
            ui.element("span").classes("time-line-wrong").props('data-past-wrong role="alert"')
        button_of("Live", PLAIN_BUTTON, "data-past-live")
