"""What both robots do now: who leads and why, how far apart they are, joints, links, events."""

from __future__ import annotations

from nicegui import ui

from operator_panel.io.page.charts import joint_title
from operator_panel.io.page.view import PageView, card, live, plain

SEVERITIES = (("", "All"), ("warning", "Warnings, faults"), ("open", "Not acknowledged"))

NAMES = {"real": "Real robot", "twin": "Twin"}


def build_lead() -> None:
    """Build both robots with what each does, an arrow to the follower, and the reason."""
    with ui.element("section").classes("card lead-card").props('data-tone="lead"'):
        with ui.element("div").classes("lead"):
            _side("real")
            live("lead.arrow", "lead-arrow")
            _side("twin")
        live("why", "why", "p").props('tabindex=0 aria-label="Why"')


def _side(side: str) -> None:
    with ui.element("div").classes(f"lead-side lead-{side}"):
        plain(NAMES[side], "lead-name")
        live(f"lead.{side}", "lead-role")


def build_deviation() -> None:
    """Build the tools' distance, beside the distance that raises an alarm, and the speed."""
    with ui.element("section").classes("card deviation-card"):
        with ui.element("div").classes("apart"):
            plain("Tools apart", "fact-title")
            live("deviation", "apart-number num").props('data-tone="deviation"')
        with ui.element("div").classes("apart-scale"):
            with ui.element("div").classes("gauge").props('data-gauge="deviation"'):
                ui.element("i").classes("gauge-fill")
            with ui.element("div").classes("gauge-words"):
                live("lag")
                live("deviation.limit")
        with ui.element("div").classes("speed-fact"):
            plain("Speed", "fact-title")
            live("speed.applied", "apart-number num").props('data-tone="speed.applied"')
            live("speed.reason", "speed-reason")


def build_joints(view: PageView) -> None:
    """Build the joint table: real, twin, deviation, and where both are between the limits."""
    with card("", "joints-card"), ui.element("table").classes("joints"):
        with ui.element("thead"), ui.element("tr"):
            for text, style in (
                ("Joint", ""),
                ("Real", "tone-real"),
                ("Twin", "tone-twin"),
                ("Apart", ""),
                ("", "unit"),
            ):
                plain(text, style, "th")
        with ui.element("tbody"):
            for joint in view.robot.twin_joints:
                with ui.element("tr"):
                    plain(joint_title(joint.name), "joint-name", "td")
                    for key in ("real", "twin", "deviation"):
                        with ui.element("td").classes("num"):
                            live(f"{joint.name}.{key}")
                    plain(joint.unit, "unit", "td")
                with ui.element("tr"), ui.element("td").classes("range").props("colspan=5"):
                    _bar(joint.name, joint.lower / joint.scale, joint.upper / joint.scale)


def _bar(name: str, lower: float, upper: float) -> None:
    minus = "\N{MINUS SIGN}"
    ends = f"{lower:g} to {upper:g}".replace("-", minus)
    with ui.element("span").classes("range-bar").props(f'data-bar="{name}" title="Range: {ends}"'):
        ui.element("i").classes("mark mark-real")
        ui.element("i").classes("mark mark-twin")


def build_links() -> None:
    """Build the two links: whether each is up, and how fresh it is."""
    with card("", "links-card"):
        for name, title in (("real", "Real robot"), ("twin", "Twin")):
            with ui.element("div").classes("link"):
                plain(title, f"link-name tone-{name}")
                live(f"link.{name}.state", "link-state").props(f'data-tone="link.{name}.state"')
                live(f"link.{name}.figures", "link-figures")


def build_alarms() -> None:
    """Build the place of the alarms, which has one size; the browser fills it."""
    with card("", "alarms-card").props('aria-live="polite"'):
        ui.element("ul").classes("alarms").props('data-alarms tabindex=0 aria-label="Alarms"')


def build_events(view: PageView) -> None:
    """Build filter, list and export of the events; the browser fills the list."""
    with ui.element("div").classes("events-head"):
        with ui.element("div").classes("segmented").props('role="tablist"'):
            for value, text in SEVERITIES:
                button = ui.element("button").props(f'type=button role=tab data-events="{value}"')
                with button:
                    plain(text)
        with ui.element("div").classes("row-line"):
            if view.is_operator:
                with (
                    ui.element("button")
                    .classes("button plain-button")
                    .props("type=button data-acknowledge=0")
                ):
                    plain("Acknowledge all")
            with (
                ui.element("a")
                .classes("button plain-button")
                .props('href="/events.csv" download="events.csv"')
            ):
                plain("Save as CSV")
    ui.element("ol").classes("events").props('data-event-list tabindex=0 aria-label="Events"')
