"""What both robots do now: joints, speed, links, alarms, decisions."""

from __future__ import annotations

from nicegui import ui

from operator_panel.io.page.charts import joint_title
from operator_panel.io.page.view import PageView, card, live, plain


def build_joints(view: PageView) -> None:
    """Build the joint table: real, twin, deviation, and where both are between the limits."""
    with card("", "joints-card"), ui.element("table").classes("joints"):
        with ui.element("thead"), ui.element("tr"):
            for text, style in (
                ("Joint", ""),
                ("Real", "tone-real"),
                ("Twin", "tone-twin"),
                ("Deviation", ""),
                ("", ""),
                ("Range", ""),
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
                    with ui.element("td").classes("range"), ui.element("div").classes("range-line"):
                        _bar(joint.name, joint.lower / joint.scale, joint.upper / joint.scale)


def _bar(name: str, lower: float, upper: float) -> None:
    plain(f"{lower:g}".replace("-", "\N{MINUS SIGN}"), "range-end")
    with ui.element("span").classes("range-bar").props(f'data-bar="{name}"'):
        ui.element("i").classes("mark mark-real")
        ui.element("i").classes("mark mark-twin")
    plain(f"{upper:g}", "range-end")


def build_links() -> None:
    """Build speed, tool deviation and the two links."""
    with card("", "links-card"):
        with ui.element("div").classes("facts"):
            for title, key in (
                ("Speed requested", "speed.requested"),
                ("applied", "speed.applied"),
                ("Tool deviation", "deviation"),
                ("Lag", "lag"),
            ):
                with ui.element("div").classes("fact"):
                    plain(title, "fact-title")
                    live(key, "num").props(f'data-tone="{key}"')
        live("speed.reason", "speed-reason")
        with ui.element("table").classes("links"):
            with ui.element("thead"), ui.element("tr"):
                for text in ("Link", "State", "Age", "Round trip", "Clock"):
                    plain(text, "", "th")
            with ui.element("tbody"):
                for name, title in (("real", "Real robot"), ("twin", "Twin")):
                    with ui.element("tr"):
                        plain(title, f"tone-{name}", "td")
                        for key in ("state", "age", "round_trip", "clock"):
                            with ui.element("td").classes("" if key == "state" else "num"):
                                place = live(f"link.{name}.{key}")
                                if key == "state":
                                    place.props(f'data-tone="link.{name}.state"')


def build_alarms() -> None:
    """Build the place of the alarms; the browser fills it."""
    with card("", "alarms-card").props('aria-live="polite"'):
        ui.element("ul").classes("alarms").props("data-alarms")


def build_decisions() -> None:
    """Build the place of the last decisions; the browser fills it."""
    ui.element("ol").classes("decisions").props("data-decisions")
