"""PID gains of one joint: as they are, what others would do, and setting them while it runs."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
from nicegui import ui
from scara_description.inertia import largest_inertia
from scara_ros.page.page_library_io import run

from operator_panel.control.fields import error_text, parse_number
from operator_panel.door import Answer, Gains
from operator_panel.page.charts_io import joint_title
from operator_panel.page.view_io import PageView, push_button
from operator_panel.step_response import Response, describe, step_response

MISSING = "Not available: the simulator offers no tuning service for this joint."
NOTE = "Set in the running simulator; the answer says how long they last."

SMALL_PX = "0.875 * parseFloat(getComputedStyle(document.documentElement).fontSize)"
"""The page's smallest letters, for a drawing, which knows no rem: the browser reckons it."""


def build_tuning(view: PageView) -> None:
    """Build the form."""
    _Tuning(view)


class _Tuning:
    """Fields for whatever parameters the joint's server has."""

    def __init__(self, view: PageView) -> None:
        self._view = view
        self._joints = {joint.name: joint for joint in view.robot.twin_joints}
        self._fields: dict[str, ui.input] = {}
        self._switches: dict[str, ui.checkbox] = {}
        self._shown: tuple[str, Gains | None] | None = None
        with ui.element("div").classes("tuning-head"):
            names = {name: joint_title(name) for name in self._joints}
            # At once: what is set must never be what the joint before had.
            self._choice = ui.select(
                names, value=next(iter(names)), label="Joint", on_change=self._refresh
            )
            self._choice.props("dense outlined stack-label options-dense").classes("field").mark(
                "tuning-joint"
            )
            self._message = ui.label(MISSING).classes("preview").mark("tuning-message")
        self._form = ui.element("div").classes("tuning")
        with ui.element("div").classes("tuning-foot"):
            push_button("Preview step", self._preview).mark("tuning-preview")
            view.button("Undo", "SPEED", "", self._undo).mark("tuning-undo")
            view.button("Set gains", "SPEED", "primary", self._set).mark("tuning-set")
        self._result = ui.label("").classes("preview").mark("tuning-result")
        self._chart = ui.echart(_step_options()).classes("step-chart")
        self._chart.set_visibility(False)
        view.after.append(lambda _, __: self._refresh())

    def _refresh(self) -> None:
        """Show another joint, or a server that comes, goes or tells its values."""
        joint = self._choice.value
        gains = self._view.door.gains(joint)
        # Ranges come by a topic of their own, often before the values that they belong to.
        # New ranges alone must not put the old values over what an operator has typed.
        values = None if gains is None else msgspec.structs.replace(gains, ranges={})
        found = (joint, values)
        if found != self._shown:
            self._shown = found
            self._message.set_text(MISSING if gains is None else NOTE)
            self._build(gains)
        if gains is not None:
            # Only hints: the simulator judges.
            for name, field in self._fields.items():
                lower, upper = gains.ranges.get(name, (-math.inf, math.inf))
                field.props(f'title="alone: {lower:.4g} to {upper:.4g}"')

    def _build(self, gains: Gains | None) -> None:
        """Make new fields with the values in force.

        A field that is already shown cannot be trusted with a new value: the browser echoes a
        value that the server sets. An echo that arrives after the next value is taken for typed
        text: then the server believes one text while the field shows another, and setting the
        believed one sends nothing. A new field starts equal on both sides, and what is still on
        its way from the old one is dropped.
        """
        self._form.clear()
        self._fields, self._switches = {}, {}
        if gains is None:
            return
        with self._form:
            for name, value in gains.values.items():
                self._fields[name] = self._number(name, f"{value:.10g}")
            for name, on in gains.switches.items():
                box = ui.checkbox(name.replace("_", " "), value=on).props("dense")
                box.classes("switch").set_enabled(self._view.is_operator)
                self._switches[name] = box

    def _number(self, name: str, value: str) -> ui.input:
        def check(text: str | None) -> str | None:
            return error_text(lambda: parse_number(text or "", name, "its unit"))

        field = ui.input(name.replace("_", " "), value=value, validation=check)
        field.props("dense outlined stack-label inputmode=decimal no-error-icon").classes("field")
        field.mark(f"gain-{name}").set_enabled(self._view.is_operator)
        return field

    def _typed(self) -> dict[str, float] | None:
        if not self._fields or not all(field.validate() for field in self._fields.values()):
            return None
        return {
            name: parse_number(field.value or "", name, "") for name, field in self._fields.items()
        }

    async def _preview(self) -> None:
        """Show the step response of the gains as they are and as typed."""
        typed, shown = self._typed(), self._shown
        if typed is None or shown is None or shown[1] is None:
            return
        joint, preview = self._joints[shown[0]], self._view.config.preview
        step = (preview.step_deg if joint.unit == "deg" else preview.step_mm) * joint.scale
        loops = _position_loop(shown[1].values), _position_loop(typed)
        ranges = tuple((each.name, each.lower, each.upper) for each in self._joints.values())

        def compute() -> list[Response]:
            inertia = _inertia(self._view.robot.description, ranges, joint.name)
            duration = preview.duration_s
            return [step_response(loop, inertia, joint.effort, step, duration) for loop in loops]

        try:
            # In a thread: the event loop of all pages hears STOP meanwhile.
            curves = await run.io_bound(compute)
        except ValueError as error:
            self._result.set_text(str(error))
            return
        # The server ends, or the form shows another joint or other gains by now.
        if curves is None or self._shown is not shown:
            return
        self._chart.set_visibility(True)
        for series, curve in zip(self._chart.options["series"], curves):
            series["data"] = [
                [time * 1e3, 100.0 * value] for time, value in zip(curve.times, curve.values)
            ]
        self._chart.update()
        self._result.set_text(f"Typed gains: {describe(curves[1])}")
        ui.run_javascript(f"getHtmlElement({self._chart.id}).scrollIntoView({{block: 'nearest'}})")

    async def _set(self) -> None:
        # All of it now: whoever waits for control may choose another joint meanwhile.
        joint, typed = self._choice.value, self._typed()
        switches = {name: bool(box.value) for name, box in self._switches.items()}
        refused = await self._view.desk.take(self._view.session.page)
        if refused or typed is None:
            self._view.tell(Answer(False, refused or "correct the marked fields"), "Gains")
            return
        answer = await self._view.door.tune(joint, typed, switches)
        self._result.set_text(answer.message)
        self._view.tell(answer, "Gains")

    async def _undo(self) -> None:
        refused = await self._view.desk.take(self._view.session.page)
        answer = Answer(False, refused) if refused else await self._view.door.undo_tuning()
        self._result.set_text(answer.message)
        self._view.tell(answer, "Gains")


@lru_cache(maxsize=64)
def _inertia(urdf: Path, ranges: tuple[tuple[str, float, float], ...], name: str) -> float:
    """Return what a joint sees, for all pages; six joints take up to a second the first time."""
    limits = {joint: (lower, upper) for joint, lower, upper in ranges}
    return largest_inertia(urdf.read_text(encoding="utf-8"), limits, name)


def _position_loop(gains: dict[str, float]) -> dict[str, float]:
    """Return p, i, d, i_clamp of the position loop, however the server prefixes them."""
    wanted = ("p", "i", "d", "i_clamp")
    return {
        short: value
        for short in wanted
        for name, value in gains.items()
        if name == short or (name.endswith(f"_{short}") and name.startswith("position"))
    }


def _step_options() -> dict[str, Any]:
    grey, thin = "#8a97a5", {"lineStyle": {"color": "rgba(138, 151, 165, 0.25)"}}
    line = {"type": "line", "showSymbol": False, "data": []}
    label = {"color": grey, ":fontSize": SMALL_PX}
    return {
        "animation": False,
        "textStyle": {":fontFamily": "getComputedStyle(document.body).fontFamily"},
        "legend": {
            "top": 0,
            "right": 8,
            "itemWidth": 14,
            "itemHeight": 2,
            "icon": "rect",
            "textStyle": label,
        },
        "grid": {
            ":left": f"4 * {SMALL_PX}",
            ":right": f"2.6 * {SMALL_PX}",
            ":top": f"2.4 * {SMALL_PX}",
            ":bottom": f"1.8 * {SMALL_PX}",
        },
        "xAxis": {
            "type": "value",
            "splitLine": {"show": False},
            "axisLabel": {
                **label,
                "formatter": "{value} ms",
                "hideOverlap": True,
                "alignMinLabel": "left",
                "alignMaxLabel": "right",
            },
        },
        "yAxis": {
            "type": "value",
            "scale": False,
            "splitLine": thin,
            "axisLabel": {**label, "formatter": "{value} %"},
        },
        "series": [
            {**line, "name": "Now", "color": grey, "lineStyle": {"width": 1.6, "type": "dashed"}},
            {**line, "name": "Typed", "color": "#e0802a", "lineStyle": {"width": 1.6}},
        ],
    }
