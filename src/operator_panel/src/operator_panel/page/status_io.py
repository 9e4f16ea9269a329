"""Joints, tools, links and alarms now, and the list of events."""

from __future__ import annotations

from nicegui import ui
from scara_ros.page.page_library_io import PLAIN_BUTTON, button_of, plain, tabs_of

from operator_panel.control import mode_table
from operator_panel.page.charts_io import joint_title
from operator_panel.page.view_io import PageView, card, live

SEVERITIES = {"": "All", "warning": "Warnings, faults", "open": "Not acknowledged"}


def build_joints(view: PageView) -> None:
    """Build a place for each joint: real, twin, how far apart, and both within the limits.

    The last place is that of the tool.
    """
    with card("", "joints-card"):
        for joint in view.robot.twin_joints:
            with ui.element("div").classes("joint"):
                plain(joint_title(joint.name), "joint-name")
                with ui.element("span").classes("joint-apart num"):
                    live(f"{joint.name}.deviation")
                    # Short: all joints and both tools stand in one row.
                    plain("\N{DEGREE SIGN}" if joint.unit == "deg" else joint.unit, "unit")
                for side in ("real", "twin"):
                    live(f"{joint.name}.{side}", f"num joint-{side} tone-{side}")
                ends = f"{joint.lower / joint.scale:g} to {joint.upper / joint.scale:g}"
                ends = ends.replace("-", "\N{MINUS SIGN}")
                bar = ui.element("span").classes("range-bar")
                with bar.props(f'data-bar="{joint.name}" title="Range: {ends}"'):
                    ui.element("i").classes("mark mark-real")
                    ui.element("i").classes("mark mark-twin")
        with ui.element("div").classes("joint tool-place").props('role=group aria-label="Tools"'):
            for side in ("real", "twin"):
                with ui.element("div").classes(f"tool-line tone-{side}"):
                    live(f"tool.{side}", "num")
                    live(f"turn.{side}", "num")


def build_alarms() -> None:
    """Build the worst alarm as a line, which opens onto all of them and both links.

    The browser fills the list; what opens lies over the tabs, so that nothing moves.
    """
    with ui.element("details").classes("card fold-card alarms-card"):
        with ui.element("summary").classes("fold-line alarms-line").props('aria-live="polite"'):
            ui.element("span").props("data-alarm-line")
        with ui.element("div").classes("fold-all alarms-all"):
            ui.element("ul").classes("alarms").props('data-alarms tabindex=0 aria-label="Alarms"')
            with ui.element("div").classes("links-card"):
                for name, title in (("real", "Real robot"), ("twin", "Twin")):
                    with ui.element("div").classes("link"):
                        plain(title, f"link-name tone-{name}")
                        live(f"link.{name}.state").props(f'data-tone="link.{name}.state"')
                        live(f"link.{name}.figures", "link-figures")
            _build_modes()


def _build_modes() -> None:
    """Build the table of the modes: what each means, and what to press."""
    with ui.element("table").classes("modes"):
        with ui.element("thead"), ui.element("tr"):
            for text in ("Mode", "It means", "Press this"):
                plain(text, "", "th")
        with ui.element("tbody"):
            for row in mode_table.ROWS:
                with ui.element("tr"):
                    for text in (row.title, row.meaning, row.press):
                        plain(text, "", "td")


def build_events(view: PageView) -> None:
    """Build filter, list and export of the events; the browser fills the list."""
    with ui.element("div").classes("events-head"):
        tabs_of(SEVERITIES, "events")
        with ui.element("div").classes("row-line"):
            if view.is_operator:
                button_of("Acknowledge all", PLAIN_BUTTON, "data-acknowledge=0")
            with (
                ui.element("a")
                .classes("button plain-button")
                .props('href="/events.csv" download="events.csv"')
            ):
                plain("Save as CSV")
    ui.element("ol").classes("events").props('data-event-list tabindex=0 aria-label="Events"')
