"""The draft as a file: brought in, handed out, and kept as one of the robot's programs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from nicegui import ui
from scara_config import ConfigError
from scara_config.frames import frame_differences
from scara_config.profile import PROGRAM_ENDING
from scara_config.programs.frame_remarks import told_frames
from scara_config.programs.keeping import keep_program, kept_file
from scara_ros.page.page_library_io import PLAIN_BUTTON, plain, run

from operator_panel.control.frame_lessons import frame_titles
from operator_panel.page.preview.asking_io import needs_judge
from operator_panel.page.view_io import PageView, push_button
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import Draft, TeachError
from operator_panel.teach.kept_io import Lesson

FILE = "/draft.LS"
MOST_BYTES = 1_000_000
JOINTS = "joints"
FORMS = {JOINTS: "Joints", "0": "Cartesian, base"}
Edit = Callable[[Draft], Draft]
Try = Callable[[str, Callable[[], Any]], Awaitable[None]]


class DraftFiles:
    """Buttons for files."""

    def __init__(
        self,
        view: PageView,
        lesson: Lesson,
        attempt: Try,
        edit: Callable[[Edit, Callable[[Draft], int]], Awaitable[None]],
        locked: Callable[[], str],
    ) -> None:
        """Build them.

        Args:
            view: The page.
            lesson: The draft.
            attempt: Does something by its name and says what is refused.
            edit: Changes the draft.
            locked: Why nobody may change the program now, or an empty text.
        """
        self._view, self._lesson = view, lesson
        self._try, self._edit, self._locked = attempt, edit, locked
        # The draft's name when the question was asked: another page may rename it.
        self._name = ""
        with ui.element("div").classes("row-line"):
            upload = ui.upload(on_upload=self._import, max_file_size=MOST_BYTES, auto_upload=True)
            upload.classes("hidden").props(f'accept="{PROGRAM_ENDING},{PROGRAM_ENDING.lower()}"')
            pick = push_button("Import", None).mark("teach-import")
            pick.on("click", js_handler=f"() => getElement({upload.id}).$refs.qRef.pickFiles()")
            view.guard(pick, "SPEED")
            with ui.element("a").classes(PLAIN_BUTTON).props(f'href="{FILE}" download'):
                plain("Export")
            view.guard(push_button("Save", self._asked).mark("teach-save"), "SPEED")
        with ui.element("div").classes("row-line"):
            self._form = ui.select(FORMS, value="0", label="Positions").mark("teach-positions")
            self._form.props("dense outlined options-dense").classes("field grow")
            view.on_frames(self._show_forms)
            needs_judge(view, push_button("Export as", partial(attempt, "Export", self._export)))
        with ui.dialog() as self._dialog, ui.element("div").classes("card confirm"):
            plain("Replace the robot's program?", "confirm-title", "h2")
            self._question = ui.label("")
            with ui.element("div").classes("row-line"):
                push_button("Cancel", self._dialog.close, props="autofocus")
                view.guard(push_button("Replace", self._replace, "primary"), "SPEED")

    def _show_forms(self) -> None:
        """Offer the user frames that there are."""
        titles = frame_titles(self._view.frames, "user").items()
        spaces = {str(number): f"Cartesian, {title}" for number, title in titles}
        forms, chosen = {**FORMS, **spaces}, self._form.value
        self._form.set_options(forms, value=chosen if chosen in forms else "0")

    async def _import(self, event: Any) -> None:
        content = (await event.file.read()).decode("utf-8", "replace")

        async def take() -> tuple[str, str]:
            name, robot = event.file.name, self._view.robot
            await self._edit(lambda _: teach.draft_of(content, robot, name), lambda _: 0)
            told = told_frames(self._lesson.draft.program)
            other = "; ".join(frame_differences(told, self._view.frames, "in the file"))
            if other:
                return "warn", f"{name} is the draft now. Its places are elsewhere: {other}"
            return "good", f"{name} is the draft now; Undo brings the former one back."

        await self._try("Import", take)
        # The field refuses a file that it has listed already: nobody could import it a second time.
        event.sender.reset()

    async def _export(self) -> tuple[str, str]:
        """Hand the draft out with its positions said otherwise."""
        draft, form = self._lesson.draft, str(self._form.value)
        asked = ("joints",) if form == JOINTS else ("cartesian", int(form))
        answer = await self._view.door.convert(draft.text, *asked)
        if not answer.success:
            raise TeachError(answer.message)
        name = f"{draft.program.name}{PROGRAM_ENDING}"
        ui.download.content(answer.values["text"], name)
        tone = "warn" if answer.message else "good"
        return tone, f"{name} was handed out. {answer.message}".strip()

    async def _asked(self) -> None:
        """Save, or ask first where a program of that name is there."""
        self._name = name = self._lesson.draft.program.name
        try:
            there = kept_file(name, self._view.around.folder).exists()
        except ConfigError:
            there = False  # what is wrong is said where it is saved
        if not there:
            await self._try("Save", partial(self._save, name))
            return
        self._question.set_text(f"{name} is there already. What it does now is lost.")
        self._dialog.open()

    async def _replace(self) -> None:
        self._dialog.close()
        await self._try("Save", partial(self._save, self._name))

    async def _save(self, name: str) -> tuple[str, str]:
        """Let the draft be one of the robot's programs, by the name for which Save was pressed.

        Raises:
            TeachError: The robot runs it, this page is not in control, the draft has another
                name by now, or it cannot be written.
        """
        refused = self._locked() or await self._view.desk.take(self._view.session.page)
        if refused:
            raise TeachError(refused)
        draft, folder = self._lesson.draft, self._view.around.folder
        if (now := draft.program.name) != name:
            raise TeachError(f"the draft is {now} by now, not {name}: press Save again")
        try:
            said = await run.io_bound(keep_program, name, draft.text, folder)
        except ConfigError as error:
            raise TeachError(str(error)) from error
        self._lesson.saved += 1
        return "good", f"{said}. A real controller has it once the file is loaded there."
