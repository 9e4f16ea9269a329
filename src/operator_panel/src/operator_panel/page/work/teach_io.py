"""Teach: a program is made line by line, tried, and taken away as a file."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import ui
from scara_config.programs.tp.listing import MotionLine
from scara_config.programs.tp.motion import FASTEST_MM_S
from scara_ros.names import current_line
from scara_ros.page import page_words
from scara_ros.page.page_library_io import plain

from operator_panel.control.fields import FieldError, parse_number
from operator_panel.page.preview.asking_io import needs_judge, play
from operator_panel.page.view_io import PageView, push_button
from operator_panel.page.work.draft_files_io import DraftFiles
from operator_panel.page.work.leading_io import CHANGED, Leading
from operator_panel.page.work.places_io import PlacesForm
from operator_panel.teach import draft as teach
from operator_panel.teach import rounds
from operator_panel.teach.draft import Draft, TeachError
from operator_panel.teach.history import Edits
from operator_panel.teach.kept_io import Lesson
from operator_panel.teach.places import joints_of
from operator_panel.view.robot.status import listing
from operator_panel.view.snapshot import Snapshot

BEGINNING = "In front of line 1"
Edit = Callable[[Draft], Draft]


def build_teach(view: PageView, lesson: Lesson) -> None:
    """Build the draft's lines and what can be done with them."""
    _Teach(view, lesson)


class _Teach:
    """The tab of one page; the draft is that of all pages."""

    def __init__(self, view: PageView, lesson: Lesson) -> None:
        self._view, self._lesson, self._robot = view, lesson, view.robot
        self._shown: tuple[object, ...] = ()
        self._rows: dict[int, ui.element] = {}
        self._marked, self._pressed = 0, ""
        # The line that was chosen when an edit was pressed. Another may be chosen while that waits
        # for the judge or for control.
        self._at = 0
        # Version of the draft that Run has asked about; another page may edit it meanwhile.
        self._asked = 0
        self._leading = Leading(view, lesson)
        self._head()
        self._list = ui.element("div").classes("teach-lines").props('role=group aria-label="Lines"')
        self._said = ui.label("").classes("verdict teach-said").props('aria-live="polite"')
        self._positions()
        self._others()
        self._tries()
        plain("Undo leads back 200 edits. Save makes it one of the robot's programs.", "hint")
        view.after.append(self._refresh)

    @property
    def _chosen(self) -> int:
        return self._leading.chosen

    def _head(self) -> None:
        with ui.element("div").classes("row-line"):
            self._name = self._field("Program", "", "teach-name")
            self._name.on("keydown.enter", partial(self._press, "Rename", self._rename))
            self._button("Rename", self._rename)
            self._button("Undo", partial(self._history, "undo"))
            self._button("Redo", partial(self._history, "redo"))
        DraftFiles(self._view, self._lesson, self._try, self._edit, self._locked)

    def _positions(self) -> None:
        with ui.element("div").classes("target"):
            self._joint = self._field("Speed J", "%", "teach-speed-j", "50")
            self._line = self._field("Speed L", "mm/s", "teach-speed-l", "100")
            self._corner = self._field("CNT", "", "teach-cnt", "", "FINE")
        self._places = PlacesForm(self._view, self._field, self._button, self._try)
        with ui.element("div").classes("row-line"):
            self._button("Record J", partial(self._record, "J"))
            self._button("Record L", partial(self._record, "L"))
            self._button("Pick", partial(self._handle, True))
            self._button("Place", partial(self._handle, False))
            self._button("Touch up", self._touch_up)
            self._button("Set speed", self._set_speed)
        with ui.element("div").classes("row-line"):
            self._button("Up", partial(self._move, -1))
            self._button("Down", partial(self._move, 1))
            self._button("Delete", self._delete)

    def _others(self) -> None:
        with ui.element("div").classes("target"):
            self._seconds = self._field("Seconds", "s", "teach-seconds", "0.5")
            self._from = self._field("From line", "", "teach-from", "1")
            self._times = self._field("Rounds", "", "teach-times", "2")
        with ui.element("div").classes("row-line"):
            self._button("Wait", self._wait)
            self._button("Add grip", partial(self._grip, True))
            self._button("Add let go", partial(self._grip, False))
            self._button("Loop", self._loop)
            self._button("Repeat", self._repeat)
        with ui.element("div").classes("row-line"):
            self._note = self._field("Name or remark", "", "teach-note").classes("grow")
            self._button("Note", self._noted)

    def _tries(self) -> None:
        view, leading = self._view, self._leading
        with ui.element("div").classes("row-line"):
            for text, act in (
                ("Step back", leading.step_back),
                ("Go to line", leading.go_here),
                ("Step", leading.step),
            ):
                view.button(text, "MOVE", "", partial(self._press, text, act))
            view.button("Run", "MOVE", "", self._question)
        with ui.element("div").classes("row-line"):
            for text, look in (("Judge all", self._judge_all), ("Preview", self._preview)):
                needs_judge(
                    view, push_button(text, look, props=f'aria-label="{text} of the draft"')
                )
        with ui.dialog() as self._dialog, ui.element("div").classes("card confirm"):
            plain("Run the draft by your lead?", "confirm-title", "h2")
            plain("Both robots move, line by line. Is nobody near them?", "", "p")
            self._verdict = ui.label("").classes("verdict").props('aria-live="polite"')
            with ui.element("div").classes("row-line"):
                push_button("Cancel", self._dialog.close, props="autofocus")
                self._confirm = view.button("Run the draft", "MOVE", "primary", self._run)

    def _field(self, label: str, unit: str, mark: str, value: str = "", empty: str = "") -> Any:
        made = ui.input(label, value=value).classes("field").mark(mark)
        shown = f'suffix="{unit}"' if unit else ""
        shown += f' placeholder="{empty}"' if empty else ""
        made.props(f"dense outlined stack-label no-error-icon {shown}")
        made.set_enabled(self._view.is_operator)
        return made

    def _button(self, text: str, act: Callable[[], Any]) -> None:
        """Make a button for an edit."""
        made = push_button(text, partial(self._press, text, act)).mark(f"teach-{text.lower()}")
        self._view.guard(made, "SPEED")

    async def _press(self, text: str, act: Callable[[], Any]) -> None:
        """Do an edit or a step; what is refused is said below the lines."""
        # The second press of a glove's two is of the line that was chosen before the first, until
        # that one is on the disk or sent: it would move, delete or execute another line.
        if self._pressed:
            self._say("warn", f"{text} was not done: {self._pressed} before it had not ended.")
            return
        self._pressed, self._at = text, self._chosen
        try:
            await self._try(text, act)
        finally:
            self._pressed = ""

    async def _try(self, text: str, act: Callable[[], Any]) -> None:
        self._say("", "")
        try:
            said = await act()
        except (TeachError, FieldError) as error:
            self._say("bad", f"{text}: {error}")
        else:
            if said:
                self._say(*said)

    def _say(self, tone: str, text: str) -> None:
        self._said.set_text(text)
        self._said.classes(replace=f"verdict teach-said {tone}")

    async def _edit(self, edit: Edit, chosen: Callable[[Draft], int]) -> None:
        """Edit the draft, if this page may.

        Raises:
            TeachError: It may not, or the edit is refused.
        """

        def change(history: Edits) -> Edits:
            made = edit(history.draft)
            return history.edited(made, chosen(made))

        await self._change(change)

    async def _change(self, change: Callable[[Edits], Edits]) -> None:
        refused = self._locked() or await self._view.desk.take(self._view.session.page)
        if refused:
            raise TeachError(refused)
        history = await self._lesson.edit(change)
        self._leading.choose(history.chosen)

    def _locked(self) -> str:
        """Return why nobody may edit now, or an empty text."""
        if self._lesson.runner:
            return f"{self._lesson.runner} runs it: STOP first, or wait for its end"
        package = self._view.door.snapshot().package
        name = self._lesson.draft.program.name
        if package is not None and current_line(package.program)[0] == name:
            return f"the robot runs {name}: it can be edited once that has ended"
        return ""

    async def _add(self, edit: Callable[[Draft, int], Draft]) -> None:
        """Add lines behind the chosen one; the last of them is chosen then."""
        after, before = self._at, self._lesson.draft
        await self._edit(
            lambda draft: edit(draft, after),
            lambda made: rounds.last_added(before, after, made),
        )

    async def _alter(self, edit: Callable[[Draft, int], Draft], by: int = 0) -> None:
        """Change the chosen line."""
        at = self._at
        await self._edit(lambda draft: edit(draft, at), lambda _: at + by)

    async def _record(self, kind: str) -> tuple[str, str]:
        speed, cnt, robot = self._speed(kind), self._cnt(), self._robot
        positions = await self._places.positions(self._lesson.draft.program)
        await self._add(lambda d, at: rounds.recorded(d, robot, at, positions, kind, speed, cnt))
        return self._used("Recorded where the twin stands; the real robot agrees with it.")

    async def _handle(self, close: bool) -> tuple[str, str]:
        robot, cnt, speeds = self._robot, self._cnt(), (self._speed("J"), self._speed("L"))
        above, there = await self._places.handled(self._lesson.draft.program)
        await self._add(
            lambda d, at: rounds.handled(d, robot, at, above, there, close, speeds, cnt)
        )
        return self._used(f"{'Picked' if close else 'Placed'} where both stand.")

    async def _repeat(self) -> tuple[str, str]:
        draft, last, robot = self._lesson.draft, self._chosen, self._robot
        first = int(parse_number(self._from.value, "From line", ""))
        taught = {
            number: joints_of(robot, draft.program, number)
            for number in rounds.own_places(draft, first, last)
        }
        moved = await self._places.moved(taught)
        await self._alter(lambda d, _: rounds.repeated(d, robot, first, last, moved))
        return self._used("")

    async def _touch_up(self) -> tuple[str, str]:
        positions, robot = await self._places.positions(self._lesson.draft.program), self._robot
        if len(positions) > 1:
            raise TeachError(f"{len(positions)} places: a position has one")
        await self._alter(lambda d, at: teach.touched_up(d, robot, at, positions[0]))
        return self._used("Touched up to where both stand.")

    def _used(self, where_both_stand: str) -> tuple[str, str]:
        """Return what to say of an edit, and forget the places that it has used."""
        count = len(self._places.places)
        self._places.clear()
        return "good", f"Places used: {count}" if count else where_both_stand

    def _speed(self, kind: str) -> float:
        if kind == "J":
            return parse_number(self._joint.value, "Speed J", "%", 0.01, 100.0)
        return parse_number(self._line.value, "Speed L", "mm/s", 0.1, FASTEST_MM_S)

    def _cnt(self) -> float | None:
        text = self._corner.value
        return parse_number(text, "CNT", "", 0.0, 100.0) if text else None

    async def _set_speed(self) -> None:
        line = teach.line_of(self._lesson.draft, self._chosen)
        speed = self._speed(line.kind if isinstance(line, MotionLine) else "J")
        cnt, robot = self._cnt(), self._robot
        await self._alter(
            lambda d, at: teach.with_corner(teach.with_speed(d, robot, at, speed), robot, at, cnt)
        )

    async def _move(self, by: int) -> None:
        await self._alter(lambda d, at: teach.moved(d, self._robot, at, by), by)

    async def _delete(self) -> None:
        await self._alter(lambda d, at: teach.deleted(d, self._robot, at), -1)

    async def _wait(self) -> None:
        seconds = parse_number(self._seconds.value, "Seconds", "s")
        await self._add(lambda d, at: teach.waiting(d, self._robot, at, seconds))

    async def _grip(self, close: bool) -> None:
        await self._add(lambda d, at: teach.gripping(d, self._robot, at, close))

    async def _loop(self) -> None:
        first = int(parse_number(self._from.value, "From line", ""))
        times = int(parse_number(self._times.value, "Rounds", ""))
        robot = self._robot
        await self._alter(lambda d, at: teach.looped(d, robot, first, at, times), 2)

    async def _noted(self) -> None:
        text, at = self._note.value, self._chosen
        before = len(self._lesson.draft.program.lines)
        await self._edit(
            lambda d: teach.noted(d, self._robot, at, text),
            lambda made: at + len(made.program.lines) - before,
        )

    async def _rename(self) -> None:
        name = str(self._name.value or "").strip().upper()
        await self._alter(lambda d, _: teach.renamed(d, self._robot, name))

    async def _history(self, way: str) -> None:
        await self._change(Edits.undo if way == "undo" else Edits.redo)

    async def _preview(self) -> None:
        draft = self._lesson.draft
        title = f"Draft {draft.program.name}"
        await play(self._view, title, "PROGRAM", program=str(self._lesson.path))

    async def _judge_all(self) -> None:
        await self._leading.judge_all()
        self._say(*self._leading.said)

    async def _question(self) -> None:
        self._asked = asked = self._lesson.history.version
        self._verdict.set_text("Judging ...")
        self._verdict.classes(replace="verdict")
        self._confirm.set_visibility(True)
        self._dialog.open()
        found = await self._leading.judge_all()
        if asked != self._asked:
            return  # Run was pressed anew: the answer to that press counts
        if asked != self._lesson.history.version:
            self._verdict.set_text(page_words.people(CHANGED))
            self._confirm.set_visibility(False)
            return
        self._verdict.set_text(found.sentence)
        self._verdict.classes(replace=f"verdict {found.tone}")
        gate = self._view.door.snapshot().gate
        self._confirm.set_visibility(not (found.is_refused and gate == "refuse"))

    async def _run(self) -> None:
        self._dialog.close()
        await self._try("Run", partial(self._leading.run, self._asked))

    def _refresh(self, snapshot: Snapshot, silent: bool) -> None:
        """Draw the lines anew when the draft or a verdict has changed, else keep the focus."""
        self._leading.look()
        history, verdicts = self._lesson.history, self._leading.verdicts
        lock = self._locked() or self._lesson.trouble
        for number in {self._marked, self._chosen} if self._marked != self._chosen else ():
            if number in self._rows:
                self._rows[number].props["aria-pressed"] = str(number == self._chosen).lower()
        self._marked = self._chosen
        shown = (history.version, tuple(verdicts.items()), lock)
        if shown == self._shown:
            return
        old, self._shown = self._shown, shown
        if not old or old[0] != history.version:
            self._name.set_value(history.draft.program.name)
        if lock:
            self._say("warn", lock)
        elif old and self._said.text == old[2]:
            self._say("", "")  # what locked it has ended, and nothing newer was said
        self._list.clear()
        self._rows.clear()
        with self._list:
            self._row(0, 0, BEGINNING)
            for line in listing(history.draft.program):
                self._row(*line)

    def _row(self, number: int, depth: int, text: str) -> None:
        chosen = number == self._chosen
        row = ui.element("button").classes("teach-line")
        row.props(f"type=button data-teach-line={number} aria-pressed={str(chosen).lower()}")
        row.on("click", partial(self._leading.choose, number))
        self._rows[number] = row
        with row:
            ui.label(str(number) if number else "").classes("num")
            ui.label(text).style(f"padding-left: {depth}rem")
            if number in self._leading.verdicts:
                tone, said = self._leading.verdicts[number]
                ui.label(said).classes(f"verdict {tone}")
