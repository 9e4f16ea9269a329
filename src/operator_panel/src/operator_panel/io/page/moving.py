"""Moving the pair by hand: commands, speed cap, jog with a held button, steps."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import ui
from scara_config import Joint

from operator_panel.control.steps import (
    AXES,
    SIZES,
    StepError,
    joint_step,
    positions_now,
    tool_step,
)
from operator_panel.door import Answer
from operator_panel.io.page.charts import joint_title
from operator_panel.io.page.view import PageView, live, plain
from operator_panel.view import words
from scara_description.urdf import Model

WAYS = {"hold": "Hold", "joints": "Step joint", "world": "World", "tool": "Tool"}
"""Name of a way of jogging: its button."""


def build_commands(view: PageView) -> None:
    """Build the row of commands and the speed."""
    with ui.element("section").classes("card commands-card"):
        with ui.element("div").classes("commands"):
            for command in ("PAUSE", "RESUME", "RESET", "HOME", "ALIGN", "ACKNOWLEDGE"):
                view.button(command.capitalize(), command)
        with ui.element("div").classes("speed"):
            plain("Speed cap", "field-title")
            slider = (
                ui.slider(min=1, max=100, step=1, value=100).classes("speed-slider").mark("speed")
            )
            shown = ui.label("100 %").classes("num speed-value")
            slider.on_value_change(lambda event: shown.set_text(f"{event.value:.0f} %"))
            view.guard(slider, "SPEED")

            async def send() -> None:
                await view.send("SPEED", speed_percent=float(slider.value))

            view.button("Set", "SPEED", "", send)


def build_jog(view: PageView, model: Model) -> None:
    """Build the four ways of jogging: hold a joint, step a joint, step the tool in two frames."""
    _Steps(view, model)


class _Steps:
    """The choice of a way, and the buttons of each; the browser shows one way at a time."""

    def __init__(self, view: PageView, model: Model) -> None:
        self._view, self._model = view, model
        self._size = 1.0
        with ui.element("div").classes("segmented jog-ways").props('role="tablist"'):
            for way, text in WAYS.items():
                with ui.element("button").props(f"type=button role=tab data-way={way}"):
                    plain(text)
        with ui.element("div").classes("jog-way").props("data-way-panel=hold"):
            _build_hold(view)
        with ui.element("div").classes("jog-way").props("data-way-panel=joints"):
            with ui.element("div").classes("jog"):
                for joint in view.robot.twin_joints:
                    self._row(joint_title(joint.name), joint.unit, self._joint(joint.name))
            self._sizes()
        for frame in ("world", "tool"):
            with ui.element("div").classes("jog-way").props(f"data-way-panel={frame}"):
                with ui.element("div").classes("jog"):
                    for axis in AXES:
                        title = f"{axis.upper()} {frame}"
                        self._row(title, "mm", self._tool(axis, frame == "tool"))
                self._sizes()

    def _row(self, title: str, unit: str, press: Callable[[float], Awaitable[None]]) -> None:
        with ui.element("div").classes("jog-row"):
            for direction in (-1, 1):
                sign = "+" if direction > 0 else words.MINUS

                async def step(direction: int = direction) -> None:
                    await press(direction * self._size)

                button = ui.button(sign, on_click=step, color=None)
                button.props(f'unelevated dense no-caps aria-label="Step {title} {sign}"')
                button.classes("button jog-button")
                self._view.guard(button, "MOVE")
                if direction < 0:
                    plain(title, "jog-name")

    def _sizes(self) -> None:
        """Build the choice of the step's length; all ways share one."""
        with ui.element("div").classes("row-line"):
            plain("Step, deg or mm", "field-title")
            choice = ui.element("div").classes("segmented").props('role="tablist"')
            with choice:
                for size in SIZES:
                    button = ui.element("button").props(f"type=button data-step={size:g}")
                    button.on("click", lambda size=size: self._choose(size))
                    with button:
                        plain(f"{size:g}")

    def _choose(self, size: float) -> None:
        self._size = size

    def _joint(self, name: str) -> Callable[[float], Awaitable[None]]:
        async def step(length: float) -> None:
            robot = self._view.robot
            unit = next(joint.unit for joint in robot.twin_joints if joint.name == name)
            title = f"Step {joint_title(name)} {_signed(length)} {unit}"
            try:
                now = positions_now(robot, self._view.door.snapshot())
                target = joint_step(robot, now, name, length)
            except StepError as error:
                self._view.tell(Answer(False, str(error)), title)
                return
            await self._view.send(
                "MOVE_JOINTS", title, joint_positions=target, speed_percent=self._speed
            )

        return step

    def _tool(self, axis: str, in_tool: bool) -> Callable[[float], Awaitable[None]]:
        async def step(length: float) -> None:
            robot = self._view.robot
            title = f"Step {axis.upper()} {_signed(length)} mm, {'tool' if in_tool else 'world'}"
            try:
                now = positions_now(robot, self._view.door.snapshot())
            except StepError as error:
                self._view.tell(Answer(False, str(error)), title)
                return
            target = tool_step(self._model, robot.tool_frame, now, axis, length, in_tool)
            await self._view.send("MOVE", title, **target, speed_percent=self._speed)

        return step

    @property
    def _speed(self) -> float:
        """As slow as a jog when the page opens [percent]."""
        return self._view.config.jog.speed_percent


def _signed(length: float) -> str:
    return words.number(length, 1 if abs(length) < 1.0 else 0, signed=True)


def _build_hold(view: PageView) -> None:
    """Build the held buttons; the browser sends signs while one is held."""
    limit = view.around.jog_limit_percent
    with ui.element("div").classes("jog"):
        for joint in view.robot.twin_joints:
            with ui.element("div").classes("jog-row"):
                _jog_button(view, joint, -1)
                plain(joint_title(joint.name), "jog-name")
                _jog_button(view, joint, 1)
    with ui.element("div").classes("jog-speed"):
        plain("Speed", "field-title")
        slider = ui.slider(
            min=0.5, max=limit, step=0.5, value=min(view.config.jog.speed_percent, limit)
        )
        slider.classes("speed-slider").props("data-jog-speed").mark("jog-speed")
        shown = ui.label("").classes("num jog-speed-value")

        def show(percent: float) -> None:
            shown.set_text(f"{percent:g} % = {_speeds(view.robot.twin_joints, percent)}")
            ui.run_javascript(f"window.panelJogPercent = {percent:g}")

        slider.on_value_change(lambda event: show(event.value))
        show(slider.value)
        view.guard(slider, "JOG")
    with ui.element("div").classes("hint"):
        plain("Hold to move, let go to stop. The real robot follows the twin.")
        live("jog", "jog-state")


def _jog_button(view: PageView, joint: Joint, direction: int) -> None:
    sign = "+" if direction > 0 else words.MINUS
    button = (
        ui.button(sign, color=None).props("unelevated dense no-caps").classes("button jog-button")
    )
    button.props(
        f'data-jog="{joint.name}" data-direction="{direction}" '
        f'aria-label="Jog {joint_title(joint.name)} {sign}"'
    )
    view.guard(button, "JOG")


def _speeds(joints: list[Joint], percent: float) -> str:
    """Return the slowest and the fastest jog of joints that turn, and that of those that slide."""
    parts = []
    for unit in ("deg", "mm"):
        speeds = [
            joint.velocity / joint.scale * percent / 100.0 for joint in joints if joint.unit == unit
        ]
        if speeds:
            low, high = f"{min(speeds):.0f}", f"{max(speeds):.0f}"
            parts.append(f"{low if low == high else f'{low} to {high}'} {unit}/s")
    return ", ".join(parts)
