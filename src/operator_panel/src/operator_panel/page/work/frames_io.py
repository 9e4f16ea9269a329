"""User and tool frames: which there are, and how one is taught by points."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from nicegui import ui
from scara_config import ConfigError
from scara_config.frames import (
    FILE,
    MOST,
    Kind,
    Numbered,
    TaughtFrame,
    frame_differences,
    save_frame,
    save_theirs,
)
from scara_description.taught_frames import FrameError
from scara_ros.page.page_library_io import plain, run

from operator_panel.control.frame_lessons import LESSONS, shown, spread_text, taught
from operator_panel.control.steps import StepError, positions_now
from operator_panel.door import Answer
from operator_panel.page.view_io import PageView, push_button

LINES = "white-space: pre-line"
NUMBERS = {str(number): str(number) for number in range(1, max(MOST.values()) + 1)}


def build_frames(view: PageView) -> None:
    """Build the list of frames and the form that teaches one."""
    with ui.element("details").classes("listing"):
        with ui.element("summary"):
            ui.label("User and tool frames")
        _FrameForm(view)


class _FrameForm:
    """The points of one frame."""

    def __init__(self, view: PageView) -> None:
        self._view = view
        self._poses: list[np.ndarray] = []
        self._theirs: Numbered = {}
        self._list = ui.label("").classes("row-text frame-list").style(LINES)
        with ui.element("div").classes("target"):
            lessons = {key: lesson.title for key, lesson in LESSONS.items()}
            self._lesson = self._choice("Points", lessons, self._again)
            self._number = self._choice("Number", NUMBERS, self._told)
            self._name = ui.input("Name", on_change=self._told)
            self._name.props("dense outlined stack-label maxlength=20").classes("field")
            self._name.mark("frame-name").set_enabled(view.is_operator)
        with ui.element("div").classes("row-line"):
            view.button("Record point", "MOVE", "", self._record).mark("frame-record")
            view.button("Begin again", "MOVE", "", self._again).mark("frame-again")
            self._save = view.button("Save", "MOVE", "", self._store).mark("frame-save")
        self._text = ui.label("").classes("preview").mark("frame-text").style(LINES)
        with ui.element("div").classes("row-line"):
            read = push_button("Read the robot's", self._read).mark("frames-read")
            read.set_enabled(view.is_operator)
            self._take = view.button("Take the robot's", "MOVE", "", self._took)
            self._take.mark("frames-take").set_visibility(False)
        with ui.element("div").classes("hint"):
            plain("Points of tool0, where the twin stands. Nothing moves.")
        view.on_frames(self._show_list)
        self._told()

    def _choice(self, label: str, values: dict[str, str], heard: Any) -> Any:
        field = ui.select(values, value=next(iter(values)), label=label, on_change=heard)
        field.props("dense outlined options-dense").classes("field").mark(f"frame-{label.lower()}")
        field.set_enabled(self._view.is_operator)
        return field

    def _show_list(self) -> None:
        view = self._view
        lines = [
            f"{kind} {number}, {frame.name}: {shown(frame)}"
            for kind in MOST
            for number, frame in view.frames.numbered(kind).items()
        ]
        self._list.set_text(view.frames_fault or "\n".join(lines) or "None was taught.")

    def _again(self) -> None:
        self._poses = []
        self._told()

    def _told(self) -> None:
        """Say what is to be recorded next, or what the points give."""
        lesson = LESSONS[self._lesson.value]
        left = lesson.points[len(self._poses) :]
        if left:
            number = len(self._poses) + 1
            self._text.set_text(f"Point {number} of {len(lesson.points)}: {left[0]}")
            self._text.classes(replace="preview")
            return
        try:
            said = f"{shown(self._frame())}{spread_text(lesson, self._poses)}"
            tone = "good"
        except FrameError as error:
            said, tone = str(error), "bad"
        self._text.set_text(said)
        self._text.classes(replace=f"preview {tone}")

    def _frame(self) -> TaughtFrame:
        lesson = LESSONS[self._lesson.value]
        return taught(lesson, (self._name.value or "").strip(), self._poses)

    def _record(self) -> None:
        lesson, view = LESSONS[self._lesson.value], self._view
        if len(self._poses) == len(lesson.points):
            view.tell(Answer(False, "all points are recorded"), "Record point")
            return
        try:
            now = positions_now(view.robot, view.door.snapshot())
        except StepError as error:
            view.tell(Answer(False, str(error)), "Record point")
            return
        self._poses.append(view.desk.arm.flange(now))
        self._told()

    async def _read(self) -> None:
        """Compare the robot's frames with those here, without a question: nothing is written."""
        self._view.read_frames()  # somebody may have edited the file
        answer = await self._view.door.robot_frames()
        self._theirs = answer.values.get("frames", {})
        differ = list(frame_differences(self._theirs, self._view.frames, "robot"))
        self._take.set_visibility(bool(differ))
        said = "\n".join(differ) or answer.message or f"The robot has those of {FILE}."
        tone = "good" if answer.success and not differ else "bad"
        self._text.set_text(said)
        self._text.classes(replace=f"preview {tone}")

    async def _took(self) -> None:
        # Those that were shown when it was pressed: whoever waits for control may read them again.
        take = partial(self._taken, self._theirs)
        await self._view.act("FRAME", "Take the robot's frames", take)

    async def _taken(self, theirs: Numbered) -> Answer:
        view = self._view
        save = partial(save_theirs, view.around.folder, theirs, view.frames)
        try:
            count = await run.io_bound(save)
            if count is None:
                return Answer(False, "the page's server is ending")
        except ConfigError as error:
            return Answer(False, str(error))
        self._take.set_visibility(False)
        view.desk.taught += 1
        self._again()
        return Answer(True, f"{count} frames of the robot are in {FILE}")

    async def _store(self) -> None:
        # As it is when it is pressed: whoever waits for control may choose another number.
        kind, number = LESSONS[self._lesson.value].kind, int(self._number.value)
        try:
            frame = self._frame()
        except FrameError as error:
            self._view.tell(Answer(False, str(error)), "Save a frame")
            return
        await self._view.act("FRAME", "Save a frame", partial(self._stored, kind, number, frame))

    async def _stored(self, kind: Kind, number: int, frame: TaughtFrame) -> Answer:
        view = self._view
        # The disk may be slow, and the stops of all pages pass through this loop.
        save = partial(save_frame, view.around.folder, kind, number, frame)
        try:
            if await run.io_bound(save) is None:
                return Answer(False, "the page's server is ending")
        except ConfigError as error:
            return Answer(False, str(error))
        view.desk.taught += 1
        self._again()
        return Answer(True, f"{frame.name} is {kind} frame {number} in {FILE}")
