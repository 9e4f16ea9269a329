"""Jogging: a joint or the tool while a button is held, and steps of both.

The browser shows one way at a time. What is held is told by the browser at each sign: which joint,
or which axis of which frame; the server judges it.
"""

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
from operator_panel.control.tool_jog import FRAMES, LINES, TURNS
from operator_panel.control.turns import turn_step, why_no_turns
from operator_panel.door import Answer
from operator_panel.page.charts_io import joint_title
from operator_panel.page.preview.asking_io import LookFirst
from operator_panel.page.view_io import PageView, live, plain
from operator_panel.view import words
from scara_description.urdf import Model

WAYS = {
    "hold": "Hold joint",
    "hold_tool": "Hold tool",
    "joints": "Step joint",
    "steps": "Step tool",
}
"""Name of a way of jogging: its button."""
STEP_LENGTHS = "Step, deg or mm"


def build_jog(view: PageView, model: Model) -> None:
    """Build the ways of jogging: hold a joint or the tool, step a joint or the tool."""
    steps = _Steps(view, model)
    with ui.element("div").classes("segmented jog-ways").props('role="tablist"'):
        for way, text in WAYS.items():
            with ui.element("button").props(f"type=button role=tab data-way={way}"):
                plain(text)
    builders: dict[str, Callable[[], None]] = {
        "hold": lambda: _build_hold(view),
        "hold_tool": lambda: _build_hold_tool(view, steps),
        "joints": steps.build_joints,
        "steps": steps.build_tool,
    }
    for way, build in builders.items():
        with ui.element("div").classes("jog-way").props(f"data-way-panel={way}"):
            build()


class _Steps:
    """Steps of one length and in one frame, both chosen once for all."""

    def __init__(self, view: PageView, model: Model) -> None:
        self._view, self._model = view, model
        self._size, self._frame = 1.0, FRAMES[0]
        self._looks = LookFirst(view)

    def build_joints(self) -> None:
        """Build a step of each joint."""
        with ui.element("div").classes("jog"):
            for joint in self._view.robot.twin_joints:
                title = joint_title(joint.name)
                self._row(title, f"Step {title}", self._joint(joint.name))
        with ui.element("div").classes("row-line"):
            self._sizes()
            self._looks.build()

    def build_tool(self) -> None:
        """Build a step of the tool along each axis, and a turn about it.

        Where the arm cannot turn its tool, one greyed turn and the reason.
        """
        with ui.element("div").classes("row-line"):
            self.frames()
        turns = set(TURNS) <= set(self._view.desk.arm.axes)
        with ui.element("div").classes("jog"):
            for axis in AXES:
                self._row(axis.upper(), f"Step {axis.upper()}", self._tool(axis))
            for axis in TURNS if turns else ():
                title = turn_title(axis)
                self._row(title, title, self._turned(axis))
            if not turns:
                _build_greyed_turn(self._view, "steps", "Step joint")
        with ui.element("div").classes("row-line"):
            self._sizes()
            self._looks.build()

    def frames(self) -> None:
        """Build the choice of the axes: those of the base, or those of the tool."""
        plain("Axes of", "field-title")
        choice = ui.element("div").classes("segmented").props('role=tablist aria-label="Axes of"')
        with choice:
            for frame in FRAMES:
                button = ui.element("button").props(f"type=button role=tab data-frame={frame}")
                button.on("click", lambda frame=frame: self._turn(frame))
                with button:
                    plain(frame.capitalize())

    def _row(self, title: str, told: str, press: Callable[[float], Awaitable[None]]) -> None:
        """Build the two steps of one thing; ``told`` is what a screen reader says of them."""
        with ui.element("div").classes("jog-row"):
            for direction in (-1, 1):
                sign = "+" if direction > 0 else words.MINUS

                async def step(direction: int = direction) -> None:
                    await press(direction * self._size)

                button = ui.button(sign, on_click=step, color=None)
                button.props(f'unelevated dense no-caps aria-label="{told} {sign}"')
                button.classes("button jog-button")
                self._view.guard(button, "MOVE")
                if direction < 0:
                    plain(title, "jog-name")

    def _sizes(self) -> None:
        """Build the choice of the step's length; all ways share one."""
        plain(STEP_LENGTHS, "field-title")
        choice = ui.element("div").classes("segmented")
        with choice.props(f'role=tablist aria-label="{STEP_LENGTHS}"'):
            for size in SIZES:
                button = ui.element("button").props(f"type=button role=tab data-step={size:g}")
                button.on("click", lambda size=size: self._choose(size))
                with button:
                    plain(f"{size:g}")

    def _choose(self, size: float) -> None:
        self._size = size

    def _turn(self, frame: str) -> None:
        self._frame = frame

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
            fields = {"joint_positions": list(target), "speed_percent": self._speed}
            await self._looks.send("MOVE_JOINTS", title, **fields)

        return step

    def _tool(self, axis: str) -> Callable[[float], Awaitable[None]]:
        async def step(length: float) -> None:
            robot, frame = self._view.robot, self._frame
            title = f"Step {axis.upper()} {_signed(length)} mm, {frame}"
            try:
                now = positions_now(robot, self._view.door.snapshot())
            except StepError as error:
                self._view.tell(Answer(False, str(error)), title)
                return
            target = tool_step(self._model, robot.tool_frame, now, axis, length, frame == "tool")
            await self._looks.send("MOVE", title, **target, speed_percent=self._speed)

        return step

    def _turned(self, axis: str) -> Callable[[float], Awaitable[None]]:
        async def step(length: float) -> None:
            view, frame = self._view, self._frame
            title = f"{turn_title(axis)} {_signed(length)} deg, {frame}"
            try:
                now = positions_now(view.robot, view.door.snapshot())
                target = turn_step(view.desk.arm, now, axis, length, frame == "tool")
            except StepError as error:
                view.tell(Answer(False, str(error)), title)
                return
            fields = {"joint_positions": target, "speed_percent": self._speed}
            await self._looks.send("MOVE_JOINTS", title, **fields)

        return step

    @property
    def _speed(self) -> float:
        """As slow as a jog when the page opens [percent]."""
        return self._view.config.jog.speed_percent


def _build_greyed_turn(view: PageView, way: str, instead: str) -> None:
    """Build a turn that nobody can press, with the reason and what to use instead below it."""
    title, reason = turn_title(TURNS[-1]), f"why-no-turns-{way}"
    with ui.element("div").classes("jog-row"):
        for direction in (-1, 1):
            sign = "+" if direction > 0 else words.MINUS
            button = ui.button(sign, color=None).classes("button jog-button")
            button.props(f'unelevated dense no-caps aria-label="{title} {sign}"')
            button.props(f"aria-describedby={reason}").set_enabled(False)
            if direction < 0:
                plain(title, "jog-name")
    plain(why_no_turns(view.robot, instead), "hint jog-why", "p").props(f"id={reason}")


def turn_title(axis: str) -> str:
    """Return the name of a turn of the tool for people."""
    return f"Turn {axis[-1].upper()}"


def _signed(length: float) -> str:
    return words.number(length, 1 if abs(length) < 1.0 else 0, signed=True)


def _build_hold(view: PageView) -> None:
    """Build the held buttons; the browser sends signs while one is held."""
    limit = view.around.jog_limit_percent
    with ui.element("div").classes("jog"):
        for joint in view.robot.twin_joints:
            with ui.element("div").classes("jog-row"):
                title, what = joint_title(joint.name), f'data-jog="{joint.name}"'
                _held_button(view, what, title, -1)
                plain(title, "jog-name")
                _held_button(view, what, title, 1)
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
    _build_hint()


def _build_hold_tool(view: PageView, steps: _Steps) -> None:
    """Build the held buttons of the tool: a line for each axis, and turns.

    Where the arm cannot turn its tool, one greyed turn and the reason.
    """
    axes, speeds = view.desk.arm.axes, view.config.jog.tool
    turns = len(axes) > len(LINES)
    with ui.element("div").classes("row-line"):
        steps.frames()
        choice = ui.element("div").classes("segmented").props('role=tablist aria-label="Speed"')
        with choice:
            for name in ("slow", "fast"):
                with ui.element("button").props(f"type=button role=tab data-pace={name}"):
                    plain(name.capitalize())
    with ui.element("div").classes("jog"):
        for axis in axes:
            title = axis.upper() if axis in LINES else turn_title(axis)
            with ui.element("div").classes("jog-row"):
                _held_button(view, f"data-axis={axis}", title, -1)
                plain(title, "jog-name")
                _held_button(view, f"data-axis={axis}", title, 1)
        if not turns:
            _build_greyed_turn(view, "hold", "Hold joint")
    text = f"Slow {speeds.slow_mm_s:g}, fast {speeds.fast_mm_s:g} mm/s"
    if turns:
        text += f"; turns {speeds.slow_deg_s:g} and {speeds.fast_deg_s:g} deg/s"
    _build_hint(f"{text}. ")


def _build_hint(before: str = "") -> None:
    with ui.element("div").classes("hint"):
        plain(f"{before}Let go to stop. The real robot follows.")
        live("jog", "jog-state")


def _held_button(view: PageView, what: str, title: str, direction: int) -> None:
    """Build a button that moves something while it is held; ``what`` says what."""
    sign = "+" if direction > 0 else words.MINUS
    button = ui.button(sign, color=None).props("unelevated dense no-caps")
    button.classes("button jog-button")
    button.props(f'{what} data-direction="{direction}" aria-label="Jog {title} {sign}"')
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
