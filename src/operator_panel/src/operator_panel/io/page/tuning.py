"""PID gains of one joint: as they are, what others would do, and setting them in the running simulator."""

from __future__ import annotations

import math
from typing import Any

from nicegui import ui

from operator_panel.control.fields import error_text, parse_number
from operator_panel.door import Answer, Gains
from operator_panel.io.page.charts import joint_title
from operator_panel.io.page.view import PageView
from operator_panel.step_response import describe, step_response

MISSING = "Not available: the simulator offers no tuning service for this joint."
NOTE = "Set in the running simulator and written to pid_gains.yaml."


def build_tuning(view: PageView) -> None:
    """Build the form."""
    _Tuning(view)


class _Tuning:
    """Fields for whatever parameters the joint's server has."""

    def __init__(self, view: PageView) -> None:
        self._view = view
        self._joints = {joint.name: joint for joint in view.robot.twin_joints}
        self._fields: dict[str, Any] = {}
        self._switches: dict[str, Any] = {}
        self._shown: tuple[str, Gains | None] | None = None
        with ui.element("div").classes("tuning-head"):
            names = {name: joint_title(name) for name in self._joints}
            # At once: what is set must never be what the joint before had.
            self._choice = ui.select(names, value=next(iter(names)), label="Joint", on_change=self._refresh)
            self._choice.props("dense outlined stack-label options-dense").classes("field").mark("tuning-joint")
            self._message = ui.label(MISSING).classes("preview").mark("tuning-message")
        self._form = ui.element("div").classes("tuning")
        with ui.element("div").classes("tuning-foot"):
            self._preview_button = ui.button("Preview step", on_click=self._preview, color=None)
            self._preview_button.props("unelevated no-caps dense").classes("button small").mark("tuning-preview")
            view.button("Undo", "SPEED", "small", self._undo).mark("tuning-undo")
            view.button("Set gains", "SPEED", "primary", self._set).mark("tuning-set")
        self._result = ui.label("").classes("preview").mark("tuning-result")
        self._chart = ui.echart(_step_options()).classes("step-chart")
        self._chart.set_visibility(False)
        view.after.append(lambda _, __: self._refresh())

    def _refresh(self) -> None:
        """Show other fields when another joint is chosen or its server comes, goes or tells its values."""
        found = (self._choice.value, self._view.door.gains(self._choice.value))
        if found == self._shown:
            return
        self._shown = found
        gains = found[1]
        self._message.set_text(MISSING if gains is None else NOTE)
        names = [*gains.values, *gains.switches] if gains is not None else []
        if names != [*self._fields, *self._switches]:
            self._build(gains)
        elif gains is not None:
            self._fill(gains)

    def _fill(self, gains: Gains) -> None:
        """Show the values in force; a range is only a hint, the simulator judges."""
        for name, value in gains.values.items():
            self._fields[name].set_value(f"{value:.10g}")
            lower, upper = gains.ranges.get(name, (-math.inf, math.inf))
            self._fields[name].props(f'title="alone: {lower:.4g} to {upper:.4g}"')
        for name, on in gains.switches.items():
            self._switches[name].set_value(on)

    def _build(self, gains: Gains | None) -> None:
        self._form.clear()
        self._fields, self._switches = {}, {}
        if gains is None:
            return
        with self._form:
            for name in gains.values:
                self._fields[name] = self._number(name)
            for name in gains.switches:
                self._switches[name] = ui.checkbox(name.replace("_", " ")).props("dense").classes("switch")
                self._switches[name].set_enabled(self._view.is_operator)
        self._fill(gains)

    def _number(self, name: str) -> Any:
        def check(text: str) -> str | None:
            return error_text(lambda: parse_number(text, name, "its unit"))

        field = ui.input(name.replace("_", " "), validation=check)
        field.props("dense outlined stack-label inputmode=decimal no-error-icon").classes("field")
        field.mark(f"gain-{name}").set_enabled(self._view.is_operator)
        return field

    def _typed(self) -> dict[str, float] | None:
        if not self._fields or not all(field.validate() for field in self._fields.values()):
            return None
        return {name: parse_number(field.value, name, "") for name, field in self._fields.items()}

    def _preview(self) -> None:
        """Show the step response of the gains as they are and as typed."""
        typed, shown = self._typed(), self._shown
        if typed is None or shown is None or shown[1] is None:
            return
        joint, preview = self._joints[shown[0]], self._view.config.preview
        step = (preview.step_deg if joint.unit == "deg" else preview.step_mm) * joint.scale
        assert joint.inertia is not None  # load_robot sees to it
        try:
            curves = [
                step_response(loop, joint.inertia, joint.effort, step, preview.duration_s)
                for loop in (_position_loop(shown[1].values), _position_loop(typed))
            ]
        except ValueError as error:
            self._result.set_text(str(error))
            return
        self._chart.set_visibility(True)
        for series, curve in zip(self._chart.options["series"], curves):
            series["data"] = [[time * 1e3, 100.0 * value] for time, value in zip(curve.times, curve.values)]
        self._chart.update()
        self._result.set_text(f"Typed gains: {describe(curves[1])}")
        ui.run_javascript(f"getHtmlElement({self._chart.id}).scrollIntoView({{block: 'nearest'}})")

    async def _set(self) -> None:
        typed = self._typed()
        refused = self._view.desk.refusal(self._view.session.page, "SPEED")
        if refused or typed is None:
            self._view.tell(Answer(False, refused or "correct the marked fields"), "Gains")
            return
        switches = {name: bool(box.value) for name, box in self._switches.items()}
        answer = await self._view.door.tune(self._choice.value, typed, switches)
        self._result.set_text(answer.message)
        self._view.tell(answer, "Gains")

    async def _undo(self) -> None:
        refused = self._view.desk.refusal(self._view.session.page, "SPEED")
        answer = Answer(False, refused) if refused else await self._view.door.undo_tuning()
        self._result.set_text(answer.message)
        self._view.tell(answer, "Gains")


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
    label = {"color": grey, "fontSize": 11}
    return {
        "animation": False,
        "legend": {"top": 0, "right": 8, "itemWidth": 14, "itemHeight": 2, "icon": "rect", "textStyle": label},
        "grid": {"left": 44, "right": 12, "top": 24, "bottom": 24},
        "xAxis": {"type": "value", "name": "ms", "nameLocation": "end", "splitLine": {"show": False}, "axisLabel": label},
        "yAxis": {"type": "value", "scale": False, "splitLine": thin, "axisLabel": {**label, "formatter": "{value} %"}},
        "series": [
            {**line, "name": "Now", "color": grey, "lineStyle": {"width": 1.6, "type": "dashed"}},
            {**line, "name": "Typed", "color": "#e0802a", "lineStyle": {"width": 1.6}},
        ],
    }
