"""Jogging: a joint or the tool while a button is held, and steps of both.

The browser shows one way at a time. What is held is told by the browser at each sign: which joint,
or which axis of which frame; the server judges it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import ui
from scara_config import Joint
from scara_ros.page.page_library_io import fill_tabs, plain, tabs_of

from operator_panel.control.jog import JogError
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
from operator_panel.page.view_io import PageView, live, push_button
from operator_panel.view import words

WAYS = {
    "hold": "Hold joint",
    "hold_tool": "Hold tool",
    "joints": "Step joint",
    "steps": "Step tool",
}
"""Name of a way of jogging: its button."""
STEP_LENGTHS = "Step, deg or mm"
Target = tuple[str, dict[str, Any]]
"""A command that moves to a target, and its fields."""
Aim = Callable[[dict[str, float], float], Target]
"""Tells the target of a step by where the joints are [rad] or [m] and its length [deg or mm]."""


def build_jog(view: PageView) -> None:
    """Build the ways of jogging: hold a joint or the tool, step a joint or the tool."""
    steps = _Steps(view)
    tabs_of(WAYS, "way", "segmented jog-ways")
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

    def __init__(self, view: PageView) -> None:
        self._view = view
        self._size, self._frame = 1.0, FRAMES[0]
        self._looks = LookFirst(view)

    def build_joints(self) -> None:
        """Build a step of each joint."""
        with ui.element("div").classes("jog"):
            for joint in self._view.robot.twin_joints:
                title = joint_title(joint.name)
                self._row(title, f"Step {title}", joint.unit, partial(self._joint, joint.name))
        self._sizes()

    def build_tool(self) -> None:
        """Build a step of the tool along each axis, and a turn about it.

        Where the arm cannot turn its tool, one greyed turn and the reason.
        """
        with ui.element("div").classes("row-line"):
            self.frames()
        turns = [axis for axis in TURNS if axis in self._view.desk.arm.axes]
        with ui.element("div").classes("jog"):
            for axis in AXES:
                told = f"Step {axis.upper()}"
                self._row(axis.upper(), told, "mm", partial(self._tool, axis), True)
            for axis in turns:
                title = turn_title(axis)
                self._row(title, title, "deg", partial(self._turned, axis), True)
            if not turns:
                _build_greyed_turn(self._view, "steps", "Step joint")
        self._sizes()

    def frames(self) -> None:
        """Build the choice of the axes: those of the base, of the tool, or of a user frame."""
        plain("Axes of", "field-title")
        row = tabs_of({}, "frame").props('aria-label="Axes of"')
        self._view.on_frames(partial(self._show_frames, row))

    def _show_frames(self, row: ui.element) -> None:
        def choose(frame: str) -> None:
            self._frame = frame

        texts = {frame: frame.capitalize() for frame in (*FRAMES, *self._view.desk.arm.frames)}
        if self._frame not in texts:
            self._frame = FRAMES[0]
        fill_tabs(row, texts, "frame", choose, self._frame)

    def _row(self, title: str, told: str, unit: str, aim: Aim, framed: bool = False) -> None:
        """Build the two steps of one thing.

        Args:
            title: Its name.
            told: What a screen reader says of it, and the page when it is stepped.
            unit: Of the step's length.
            aim: Tells where a step leads.
            framed: Whether it depends on the chosen axes.
        """
        view = self._view

        async def step(direction: int) -> None:
            length = direction * self._size
            signed = words.number(length, 1 if abs(length) < 1.0 else 0, signed=True)
            text = f"{told} {signed} {unit}" + (f", {self._frame}" if framed else "")
            try:
                command, fields = aim(positions_now(view.robot, view.door.snapshot()), length)
            except (StepError, JogError) as error:
                view.tell(Answer(False, str(error)), text)
                return
            # As slow as a jog when the page opens.
            percent = view.config.jog.speed_percent
            await self._looks.send(command, text, **fields, speed_percent=percent)

        def build(direction: int, sign: str) -> None:
            button = push_button(sign, partial(step, direction), "jog-button")
            view.guard(button.props(f'aria-label="{told} {sign}"'), "MOVE")

        _both_ways(title, build)

    def _sizes(self) -> None:
        """Build the choice of the step's length, which all ways share, and of a preview."""

        def choose(size: str) -> None:
            self._size = float(size)

        with ui.element("div").classes("row-line"):
            plain(STEP_LENGTHS, "field-title")
            sizes = {f"{size:g}": f"{size:g}" for size in SIZES}
            tabs_of(sizes, "step", heard=choose).props(f'aria-label="{STEP_LENGTHS}"')
            self._looks.build()

    def _joint(self, name: str, now: dict[str, float], length: float) -> Target:
        target = joint_step(self._view.robot, now, name, length)
        return "MOVE_JOINTS", {"joint_positions": target}

    def _tool(self, axis: str, now: dict[str, float], length: float) -> Target:
        return "MOVE", tool_step(self._view.desk.arm, now, axis, length, self._frame)

    def _turned(self, axis: str, now: dict[str, float], length: float) -> Target:
        target = turn_step(self._view.desk.arm, now, axis, length, self._frame)
        return "MOVE_JOINTS", {"joint_positions": target}


def _both_ways(title: str, build: Callable[[int, str], None]) -> None:
    """Build a row: backwards, the name, forwards."""
    with ui.element("div").classes("jog-row"):
        build(-1, words.MINUS)
        plain(title, "jog-name")
        build(1, "+")


def _build_greyed_turn(view: PageView, way: str, instead: str) -> None:
    """Build a turn that nobody can press, with the reason and what to use instead below it."""
    title, reason = turn_title(TURNS[-1]), f"why-no-turns-{way}"

    def build(_: int, sign: str) -> None:
        props = f'aria-label="{title} {sign}" aria-describedby={reason}'
        push_button(sign, None, "jog-button", props).set_enabled(False)

    _both_ways(title, build)
    plain(why_no_turns(view.robot, instead), "hint jog-why", "p").props(f"id={reason}")


def turn_title(axis: str) -> str:
    """Return the name of a turn of the tool for people."""
    return f"Turn {axis[-1].upper()}"


def _build_hold(view: PageView) -> None:
    """Build the held buttons; the browser sends signs while one is held."""
    limit = view.around.jog_limit_percent
    with ui.element("div").classes("jog"):
        for joint in view.robot.twin_joints:
            _held_row(view, f'data-jog="{joint.name}"', joint_title(joint.name))
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
        tabs_of({"slow": "Slow", "fast": "Fast"}, "pace").props('aria-label="Speed"')
    with ui.element("div").classes("jog"):
        for axis in axes:
            title = axis.upper() if axis in LINES else turn_title(axis)
            _held_row(view, f"data-axis={axis}", title)
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


def _held_row(view: PageView, what: str, title: str) -> None:
    """Build the buttons that move something while one is held; ``what`` says what."""

    def build(direction: int, sign: str) -> None:
        button = push_button(sign, None, "jog-button", f'{what} data-direction="{direction}"')
        view.guard(button.props(f'aria-label="Jog {title} {sign}"'), "JOG")

    _both_ways(title, build)


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
