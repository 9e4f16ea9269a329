"""A tool position that is asked about while it is typed, shown as a ghost, and sent by a button."""

from __future__ import annotations

import json
import math
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Any

from nicegui import ui
from scara_config.frames import Kind, TaughtFrame
from scara_config.programs.tp.motion import FASTEST_MM_S
from scara_ros.page.page_library_io import plain

from operator_panel.control.fields import error_text, parse_number
from operator_panel.control.frame_lessons import frame_titles
from operator_panel.control.tool_jog import TURNS
from operator_panel.door import Answer
from operator_panel.page.preview.asking_io import needs_judge, play
from operator_panel.page.preview.motion_line_io import build_gate_line
from operator_panel.page.view_io import PageView, live, push_button
from operator_panel.view import words

AXES = ("x", "y", "z")
MOST_DEG = 720.0
ELBOWS = {"": "Nearest", "righty": "Righty", "lefty": "Lefty"}
WAYS = {"": "Joints", "linear": "Line"}
PREVIEW_DELAY_S = 0.25
WIDEST_MM = 5000.0
ASK = "Type or choose a position of the tool."


def build_target(view: PageView) -> None:
    """Build the form."""
    _TargetForm(view)


class _TargetForm:
    """Fields, preview and button of one page."""

    def __init__(self, view: PageView) -> None:
        self._view = view
        self._asked = 0
        with ui.element("div").classes("target"):
            self._fields = {
                axis: self._number(axis.upper(), "mm", "", -WIDEST_MM, WIDEST_MM) for axis in AXES
            }
        with ui.element("div").classes("target"):
            self._speed = self._number("Speed", "%", "50", 1.0, 100.0)
            self._elbow = self._choice("Elbow", ELBOWS)
            # Empty: the tool stays as it is turned.
            self._yaw = self._number("Yaw", "deg", "", -MOST_DEG, MOST_DEG)
            self._yaw.set_visibility(TURNS[-1] in view.desk.arm.axes)
            self._elbow.set_visibility(
                view.robot.geometry is not None
            )  # only a SCARA has branches by name
            self._way = self._choice("Way", WAYS)
            # Empty: as fast as the joints allow.
            self._tool_speed = self._number("Tool speed", "mm/s", "", 1.0, FASTEST_MM_S)
            self._tool_speed.bind_visibility_from(self._way, "value", bool)
            self._frame = self._numbers("Frame", "Base", "user")
            self._tool = self._numbers("Tool", "tool0", "tool")
            view.button("Move", "MOVE", "primary tall", self._move)
        with ui.element("div").classes("target-picks"):
            for name, position in view.around.positions.items():
                texts = [f"{value * 1e3:g}" for value in position]
                pick = push_button(name, partial(self._pick, texts)).mark(f"pick-{name.lower()}")
                pick.set_enabled(view.is_operator)
            push_button("Clear", self._clear).mark("target-clear")
        with ui.element("div").classes("row-line"):
            plain("Preview", "field-title")
            for text, ask in (("Move", self._try_move), ("Home", self._try_home)):
                button = push_button(text, ask, props=f'aria-label="Preview {text}"')
                needs_judge(view, button.mark(f"preview-{text.lower()}"))
            build_gate_line()
        self._text = ui.label(ASK).classes("preview").mark("preview")
        # The gripper's switches; the twin controller passes them on to the real robot.
        with ui.element("div").classes("row-line gripper"):
            plain("Gripper", "field-title")
            for text, close in (("Grip", True), ("Let go", False)):
                view.button(text, "MOVE", "", partial(view.grip, text, close))
            live("gripper", "row-text")

    def _numbers(self, label: str, none: str, kind: Kind) -> Any:
        """Build the choice of a frame by its number; without any it is not there."""
        field = self._choice(label, {"": none})
        before: dict[int, TaughtFrame] = {}

        def show() -> None:
            frames = self._view.frames.numbered(kind)
            titles = frame_titles(self._view.frames, kind).items()
            names = {"": none} | {str(number): title for number, title in titles}
            chosen = field.value if field.value in names else ""
            field.set_options(names, value=chosen)
            field.set_visibility(len(names) > 1)
            if chosen and frames[int(chosen)] != before.get(int(chosen)):
                # What is said of the position is of the frame as it was. No event of this page has
                # led here: without its place the browser could not be told.
                with field.parent_slot:
                    self._typed()
            before.clear()
            before.update(frames)

        self._view.on_frames(show)
        return field

    def _choice(self, label: str, values: dict[str, str]) -> Any:
        field = ui.select(values, value="", label=label, on_change=self._typed)
        field.props("dense outlined options-dense").classes("field").mark(f"target-{label.lower()}")
        field.set_enabled(self._view.is_operator)
        return field

    def _number(self, label: str, unit: str, value: str, lower: float, upper: float) -> Any:
        def check(text: str) -> str | None:
            return (
                error_text(lambda: parse_number(text, label, unit, lower, upper)) if text else None
            )

        field = ui.input(label, value=value, validation=check, on_change=self._typed)
        field.props(
            f'dense outlined stack-label suffix="{unit}" inputmode=decimal no-error-icon'
        ).classes("field")
        field.mark(f"target-{label.split()[0].lower()}").set_enabled(self._view.is_operator)
        return field

    def _fill(self, texts: Sequence[str]) -> None:
        for field, text in zip(self._fields.values(), texts, strict=True):
            field.set_value(text)

    def _pick(self, texts: Sequence[str]) -> None:
        # The robot's positions are told in its base: another frame would lead both elsewhere.
        self._frame.set_value("")
        self._fill(texts)

    def _clear(self) -> None:
        self._fill(("",) * len(AXES))
        self._yaw.set_value("")

    def _typed(self) -> None:
        """Close a preview of what was typed before; ask a little later, once nothing more comes."""
        self._asked += 1
        number = self._asked
        ui.run_javascript("window.panel?.typed()")

        async def ask() -> None:
            if number == self._asked:
                await self._preview(number)

        ui.timer(PREVIEW_DELAY_S, ask, once=True)

    def _point(self) -> dict[str, float] | None:
        """Return x, y, z [m]; None while a field is wrong or empty."""
        texts = [(axis, field.value) for axis, field in self._fields.items()]
        if any(
            error_text(lambda a=axis, t=text: parse_number(t, a, "mm", -WIDEST_MM, WIDEST_MM))
            for axis, text in texts
        ):
            return None
        return {axis: parse_number(text, axis, "mm") * 1e-3 for axis, text in texts}

    def _turn(self) -> dict[str, Any]:
        """Return the yaw [rad]; nothing: it is empty, and the tool stays as it is turned.

        Raises:
            ValueError: It is no number.
        """
        text = self._yaw.value
        if not text:
            return {}
        angle = parse_number(text, "Yaw", "deg", -MOST_DEG, MOST_DEG)
        return {"has_yaw": True, "yaw": math.radians(angle)}

    def _line(self) -> dict[str, Any]:
        """Return the way of the tool and its speed there.

        Raises:
            ValueError: The speed is no number.
        """
        if not self._way.value:
            return {}
        text = self._tool_speed.value
        speed = parse_number(text, "Tool speed", "mm/s", 1.0, FASTEST_MM_S) if text else 0.0
        return {"path": self._way.value, "speed_mm_s": speed}

    def _frames(self) -> dict[str, int]:
        """Return the numbers of the user frame and the tool, if any is chosen."""
        chosen = {"frame": self._frame.value, "tool": self._tool.value}
        return {name: int(value) for name, value in chosen.items() if value}

    async def _preview(self, number: int) -> None:
        point = self._point()
        if point is None or error_text(self._turn):
            self._show(ASK, "", None)
            return
        wrong = error_text(lambda: parse_number(self._speed.value, "Speed", "%", 1.0, 100.0))
        percent = 0.0 if wrong else parse_number(self._speed.value, "Speed", "%")
        elbow, path = self._elbow.value or "", self._way.value or ""
        how = {"elbow": elbow, "path": path, **self._turn(), **self._frames()}
        answer = await self._view.door.judge(**point, speed_percent=percent, **how)
        if number != self._asked:
            return
        if answer.success:
            self._show(*self._reachable(answer))
        else:
            self._show(f"Not reachable: {answer.message}", "bad", None)

    def _reachable(self, answer: Answer) -> tuple[str, str, dict[str, float]]:
        """Return where the move leads, and why none may begin now."""
        values = answer.values
        there = dict(zip(values["name"], map(float, values["target"])))
        joints = self._view.robot.arm_joints
        pose = {joint.name: there[joint.name] for joint in joints}
        shown = [f"{words.number(pose[j.name] / j.scale)} {j.unit}" for j in joints]
        elbow, later = values["elbow"], values["refused_now"]
        text = f"Reachable{f', {elbow}' if elbow else ''}: {', '.join(shown)}"
        if later:
            text += f". Not now: {later}"
        return text, "good", pose

    def _show(self, text: str, tone: str, pose: dict[str, float] | None) -> None:
        self._text.set_text(text)
        self._text.classes(replace=f"preview {tone}")
        ui.run_javascript(f"window.panel?.preview({json.dumps(pose)})")

    async def _try_move(self) -> None:
        await self._go(self._play_move)

    async def _try_home(self) -> None:
        view = self._view
        home, percent = list(view.robot.home_positions), view.around.home_percent
        await play(view, "Home", "MOVE_JOINTS", joint_positions=home, speed_percent=percent)

    async def _play_move(self, **fields: Any) -> None:
        place = ", ".join(f"{axis} {words.number(1e3 * fields[axis], 0)}" for axis in AXES)
        await play(self._view, f"Move to {place} mm", "MOVE", **fields)

    async def _move(self) -> None:
        await self._go(partial(self._view.send, "MOVE", ""))

    async def _go(self, then: Callable[..., Awaitable[Any]]) -> None:
        """Hand what the fields say to ``then``, unless one of them is wrong."""
        point = self._point()
        speed = error_text(lambda: parse_number(self._speed.value, "Speed", "%", 1.0, 100.0))
        wrong = speed or error_text(self._turn) or error_text(self._line)
        if point is None or wrong:
            self._view.tell(Answer(False, wrong or "x, y and z are needed"), "Move")
            return
        percent = parse_number(self._speed.value, "Speed", "%")
        asked = {"speed_percent": percent, "elbow": self._elbow.value or "", **self._turn()}
        await then(**point, **asked, **self._line(), **self._frames())
