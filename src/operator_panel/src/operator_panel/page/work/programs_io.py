"""Programs of the real robot, started on its pendant; what it runs now."""

from __future__ import annotations

import time
from functools import partial

from nicegui import ui
from scara_config import ConfigError
from scara_config.programs.files import program_files, read_listing
from scara_config.programs.tp.listing import Program
from scara_ros.page.page_library_io import plain

from operator_panel.control.fields import error_text, parse_number
from operator_panel.page.preview.asking_io import ONLY_LOOKS, ask, needs_judge, play
from operator_panel.page.preview.motion_line_io import build_gate_line
from operator_panel.page.view_io import PageView, live, push_button
from operator_panel.teach.kept_io import Lesson
from operator_panel.view.robot.status import listing
from operator_panel.view.snapshot import Snapshot

KEYS = {"run": ("RUN", "Program"), "override": ("OVERRIDE", "Override of the robot")}
"""Key of the pendant: the command that the page follows, and its title."""


def build_programs(view: PageView, lesson: Lesson) -> None:
    """Build the list and the override."""
    with ui.element("div").classes("facts"):
        for title, key in (
            ("Program", "robot.program"),
            ("Speed", "robot.speed"),
            ("Robot", "robot.ready"),
        ):
            with ui.element("div").classes("fact"):
                plain(title, "fact-title")
                live(key, "num")
    rows = ui.element("div").classes("rows")
    _Rows(view, lesson, rows)
    with ui.element("div").classes("row-line"):
        plain("Override", "field-title")

        def check(text: str) -> str | None:
            return error_text(lambda: parse_number(text, "Override", "%", 1.0, 100.0))

        field = ui.input(value="100", validation=check).props(
            'dense outlined suffix="%" inputmode=decimal no-error-icon'
        )
        field.classes("field").mark("override")
        view.guard(field, "SPEED")

        async def send() -> None:
            if field.validate():
                await _say(view, "override", f"{parse_number(field.value, 'Override', '%'):.0f}")

        view.button("Set", "SPEED", "", send).mark("override-set")
        plain("10 % after a cold start", "row-text")
    with ui.element("div").classes("hint"):
        build_gate_line()
        plain("Keys of the robot's own pendant. The twin follows.")


class _Rows:
    """The robot's programs; one that was saved meanwhile is added, or shows its new lines."""

    def __init__(self, view: PageView, lesson: Lesson, rows: ui.element) -> None:
        self._view, self._lesson, self._place = view, lesson, rows
        self._saved = lesson.saved
        self._rows: dict[str, tuple[ui.label, ui.element]] = {}
        for program in self._programs():
            self._row(program)
        view.after.append(self._refresh)

    def _programs(self) -> tuple[Program, ...]:
        """Return those of the folder; a file that is wrong now must not keep a page closed."""
        try:
            files = program_files(self._view.around.folder).values()
            return tuple(read_listing(file) for file in files)
        except ConfigError:
            return self._view.around.programs

    def _refresh(self, _: Snapshot, __: bool) -> None:
        if self._saved == self._lesson.saved:
            return
        self._saved = self._lesson.saved
        for program in self._programs():
            if program.name not in self._rows:
                self._row(program)
                continue
            comment, lines = self._rows[program.name]
            comment.set_text(program.comment)
            lines.clear()
            _lines(lines, program)

    def _row(self, program: Program) -> None:
        view, name = self._view, program.name
        with self._place:
            with ui.element("div").classes("row-line"):
                plain(name, "row-name")
                comment = ui.label(program.comment).classes("row-text")
                preview = partial(play, view, f"Program {name}", "PROGRAM", program=name)
                button = push_button("Preview", preview)
                # A file may have any name: within the text of props some would raise.
                button.props["aria-label"] = f"Preview {name}"
                needs_judge(view, button)
                _press(view, "Run", "RUN", f"run-{name.lower()}", "run", name)
            with ui.element("details").classes("listing"):
                with ui.element("summary"):
                    ui.label(f"Lines of {name}")
                lines = ui.element("ol")
                lines.props["data-program"] = name
        _lines(lines, program)
        self._rows[name] = comment, lines


def _lines(place: ui.element, program: Program) -> None:
    """Build a program's listing; the browser marks the line that it is in."""
    with place:
        for number, depth, text in listing(program):
            with ui.element("li").props(f"data-line={number} value={number}"):
                ui.label(text).style(f"padding-left: {depth}rem")


def _press(view: PageView, text: str, command: str, mark: str, *keys: str) -> None:
    """Build a button that starts a program once it is confirmed: both robots move by it.

    Meanwhile the second world judges it. One that the gate would refuse has no button to confirm.
    """
    name = keys[-1]

    async def press() -> None:
        dialog.close()
        await _say(view, *keys)

    async def question() -> None:
        verdict.set_text("Judging ...")
        verdict.classes(replace="verdict")
        confirm.set_visibility(True)
        dialog.open()
        found = await ask(view, f"Program {name}", "PROGRAM", program=name, **ONLY_LOOKS)
        verdict.set_text(found.sentence)
        verdict.classes(replace=f"verdict {found.tone}")
        confirm.set_visibility(not (found.is_refused and view.door.snapshot().gate == "refuse"))

    with ui.dialog() as dialog, ui.element("div").classes("card confirm"):
        plain(f"Run {name} on the robot?", "confirm-title", "h2")
        plain("The real robot moves, and the twin follows. Is nobody near it?", "", "p")
        verdict = ui.label("").classes("verdict").props('aria-live="polite"')
        with ui.element("div").classes("row-line"):
            push_button("Cancel", dialog.close, props="autofocus")
            confirm = view.button(f"Run {name}", command, "primary", press)
            confirm.mark(f"{mark}-confirmed")
    view.button(text, command, "", question).mark(mark)


async def _say(view: PageView, *keys: str) -> None:
    """Press a key of the pendant, if this page is in control."""
    kind, title = KEYS.get(keys[0], (keys[0], keys[0].capitalize()))
    title = f"{title} {' '.join(keys[1:])}".strip()
    asked, barred = time.monotonic(), partial(view.desk.refusal, view.session.page)
    await view.act(kind, title, lambda: view.door.pendant(*keys, asked=asked, barred=barred))
