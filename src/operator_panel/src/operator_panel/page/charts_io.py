"""Live charts of one joint: positions and deviation, and its PID loop.

The browser keeps the points and draws them.
"""

from __future__ import annotations

from typing import Any

from nicegui import ui
from scara_ros.page.page_library_io import PLAIN_BUTTON, button_of, plain, tabs_of

from operator_panel.page.view_io import PageView
from operator_panel.view.frame import PAIR, PAIR_QUANTITIES

KINDS = {
    "real": "Real",
    "twin": "Twin",
    "apart": "Apart",
    "setpoint": "Set point",
    "measured": "Measured",
    "error": "Error",
    "effort": "Effort",
}
"""Quantities of a joint: their names in an address, and for people."""
# Name, colour and axis: 0 in the upper panel, 1 left and 2 right in the lower one.
MOTION_SERIES = [("Real", "real", 0), ("Twin", "twin", 0), ("Deviation", "deviation", 1)]
LOOP_SERIES = [
    *(("Set point", "setpoint", 0), ("Measured", "twin", 0)),
    *(("Error", "deviation", 1), ("Effort", "effort", 2)),
]
MOST = 6  # our choice: more lines than that nobody tells apart


def build_charts(view: PageView) -> dict[str, Any]:
    """Build both charts; return what the browser needs to feed them."""
    joints = {joint.name: joint for joint in view.robot.twin_joints}
    with ui.element("section").classes("charts-card"):
        with ui.element("div").classes("charts-head"):
            title = ui.element("h2").classes("card-title").props("data-chart-title")
            with title:
                plain(f"Last {view.config.chart_window_s:g} s")
            button_of("Freeze", PLAIN_BUTTON, "data-pause aria-pressed=false")
            tabs_of({"motion": "Motion", "loop": "Loop"}, "chart", "segmented chart-choice")
            tabs_of({name: joint_title(name) for name in joints}, "select")
            button_of("Choose", PLAIN_BUTTON, "data-plot-choose aria-expanded=false")
        with ui.element("div").classes("charts"):
            panel = {"gridIndex": 1, "scale": True, "splitNumber": 2}
            motion, loop = (
                ui.echart(
                    _options(series, right, [{"gridIndex": 0, "scale": True}, panel, *further])
                ).classes("chart")
                for series, right, further in (
                    (MOTION_SERIES, 14, []),
                    (LOOP_SERIES, 36, [{**panel, "position": "right"}]),
                )
            )
            ui.element("ul").classes("plot-legend").props("data-plot-legend")
            own = ui.echart({"animation": False, "series": []}).classes("chart chart-own")
        _build_choice(list(joints))
    return {
        "motion": motion.id,
        "loop": loop.id,
        "own": own.id,
        "most": MOST,
        "quantities": _quantities(view),
        "window": view.config.chart_window_s,
        "units": {name: joint.unit for name, joint in joints.items()},
        "efforts": {name: "N m" if joint.unit == "deg" else "N" for name, joint in joints.items()},
    }


def _build_choice(joints: list[str]) -> None:
    """Build a button for each quantity; it lies over the charts while somebody chooses."""
    with ui.element("div").classes("plot-choice").props("data-plot-choice hidden"):
        with ui.element("div").classes("row-line"):
            plain(f"Up to {MOST} in one chart; the address keeps them", "field-title")
            for name, text in (("clear", "Clear"), ("close", "Done")):
                button_of(text, PLAIN_BUTTON, f"data-plot-{name}")
        for name in joints:
            _row(joint_title(name), {f"{name}.{kind}": text for kind, text in KINDS.items()})
        _row("Pair", {f"{PAIR}.{kind}": one.title for kind, one in PAIR_QUANTITIES.items()})


def _row(title: str, quantities: dict[str, str]) -> None:
    group = ui.element("div").classes("plot-row").props(f'role=group aria-label="{title}"')
    with group:
        plain(title, "field-title")
        for key, text in quantities.items():
            props = f'data-plot="{key}" aria-pressed=false aria-label="{title}: {text}"'
            button_of(text, "plot-pick", props)


def _quantities(view: PageView) -> dict[str, dict[str, str]]:
    """Return name and unit of each quantity, by its key."""
    found = {}
    for joint in view.robot.twin_joints:
        for kind, text in KINDS.items():
            unit = joint.unit
            if kind == "effort":
                unit = "N m" if joint.unit == "deg" else "N"
            title = f"{joint_title(joint.name)} {text.lower()}"
            found[f"{joint.name}.{kind}"] = {"title": title, "unit": unit}
    for kind, one in PAIR_QUANTITIES.items():
        found[f"{PAIR}.{kind}"] = {"title": one.title, "unit": one.unit}
    return found


def joint_title(name: str) -> str:
    """Return a joint's name for people."""
    return name.removesuffix("_joint").replace("_", " ").capitalize()


def _options(
    series: list[tuple[str, str, int]], right: int, y_axes: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return a chart of two grids, one above the other; the browser sets the theme's colours."""
    sides = {"left": 44, "right": right}
    axis = {"type": "value", "axisLabel": {"hideOverlap": True}, "splitLine": {"show": False}}
    return {
        "animation": False,
        "tooltip": {"trigger": "axis", "confine": True, "transitionDuration": 0},
        "axisPointer": {"link": [{"xAxisIndex": "all"}]},
        "dataZoom": [
            {"type": "inside", "xAxisIndex": [0, 1], "filterMode": "none", "disabled": True}
        ],
        "legend": {"top": 0, "right": 4, "itemWidth": 14, "itemHeight": 2, "icon": "rect"},
        "grid": [
            {**sides, "top": 26, "height": "42%"},
            {**sides, "bottom": 20, "height": "22%"},
        ],
        "xAxis": [{**axis, "gridIndex": 0, "axisLabel": {"show": False}}, {**axis, "gridIndex": 1}],
        "yAxis": [{"type": "value", **one} for one in y_axes],
        "series": [
            {
                "name": name,
                "type": "line",
                "showSymbol": False,
                "data": [],
                "xAxisIndex": 0 if place == 0 else 1,
                "yAxisIndex": place,
                "lineStyle": {"width": 1.6, "type": "dashed" if role == "setpoint" else "solid"},
                "id": role,
            }
            for name, role, place in series
        ],
    }
