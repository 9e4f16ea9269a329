"""Recordings: start, stop, the list of runs, a report in the page."""

from __future__ import annotations

import time
from collections.abc import Awaitable
from pathlib import Path

from nicegui import run, ui
from scara_ros.page.page_library_io import PLAIN_BUTTON, button_of, plain

from operator_panel.control.fields import error_text, parse_run_name
from operator_panel.door import Answer
from operator_panel.page.records.dialogs_io import ask_delete, ask_name
from operator_panel.page.view_io import PageView, push_button
from operator_panel.retelling.run_folders_io import (
    RunFolderError,
    bag_of,
    delete_run,
    list_runs,
    rename_run,
)
from operator_panel.runs import Run
from operator_panel.view.alarms import DIAGNOSIS_MEMORY_S
from operator_panel.view.snapshot import Snapshot

REFRESH_S = 3.0


def build_recordings(view: PageView, folder: Path) -> None:
    """Build the form and the list."""
    _Recordings(view, folder)


class _Recordings:
    def __init__(self, view: PageView, folder: Path) -> None:
        self._view, self._folder = view, folder
        self._listed: tuple[object, ...] = ()
        with ui.element("div").classes("row-line"):

            def check(text: str) -> str | None:
                return error_text(lambda: parse_run_name(text))

            self._name = ui.input("Name", validation=check).props(
                'dense outlined stack-label placeholder="date and time" no-error-icon'
            )
            self._name.classes("field grow").mark("run-name").set_enabled(view.is_operator)
            view.button("Start", "SPEED", "primary", self._start).mark("record-start")
            view.button("Stop", "SPEED", "", self._stop).mark("record-stop")
        self._status = ui.label("").classes("preview").mark("record-status")
        self._list = ui.element("div").classes("rows scroll")
        # A question goes with the element in which it is asked; the rows are built again.
        self._questions = ui.element("div")
        view.after.append(self._refresh)
        ui.timer(REFRESH_S, self._look)
        ui.timer(0.1, self._look, once=True)

    async def _start(self) -> None:
        if not self._name.validate():
            return
        name = parse_run_name(self._name.value)
        path = str(self._folder / name / "run.bag") if name else ""
        await self._do("Recording", self._view.door.record(path))

    async def _stop(self) -> None:
        await self._do("Recording", self._view.door.stop_recording())

    async def _do(self, what: str, call: Awaitable[Answer]) -> None:
        refused = self._view.desk.refusal(self._view.session.page)
        if refused:
            # The call was made by who asks, and Python complains of one that nobody ever awaits.
            call.close()  # type: ignore[attr-defined]
            self._view.tell(Answer(False, refused), what)
            return
        self._view.tell(await call, what)
        await self._look()

    def _refresh(self, snapshot: Snapshot, _: bool) -> None:
        found = [d for name, d in snapshot.diagnoses.items() if name.endswith("recorder")]
        if not found:
            self._status.set_text("Recorder: not heard of yet")
            return
        newest = max(found, key=lambda each: each.received)
        # What a recorder that has died said last is still among the diagnoses.
        quiet_s = time.monotonic() - newest.received
        silent = f"silent for {quiet_s:.0f} s: nothing may be recorded. Is its node running?"
        said = newest.message if quiet_s < DIAGNOSIS_MEMORY_S else silent
        self._status.set_text(f"Recorder: {said}")

    async def _look(self) -> None:
        found = await run.io_bound(list_runs, self._folder)
        shown = (found, self._view.door.reporting())
        if found is None or shown == self._listed:
            return
        self._listed = shown
        self._list.clear()
        with self._list:
            if not found:
                plain("No runs yet.", "hint")
            for one in found:
                self._line(one)

    def _line(self, one: Run) -> None:
        with ui.element("div").classes("run"):
            ui.label(one.name).classes("row-name")
            facts = (one.when, one.length, one.size, one.verdict)
            ui.label(", ".join(each for each in facts if each)).classes("row-text")
            if one.missing:
                ui.label(one.missing).props('data-is="bad"')
            with ui.element("div").classes("row-line"):
                # Opens the recording on the time line: see web/past.js.
                look_back = button_of("Look back", PLAIN_BUTTON, f'data-look-at="{one.name}"')
                look_back.props("disabled" if one.busy or not one.bags else "")
                if one.has_report:
                    # In a tab of its own: over the page it would lie on STOP and take its keys.
                    address = f'href="/runs/{one.name}/report.html" target="_blank" rel="noopener"'
                    with ui.element("a").classes("button plain-button").props(address):
                        plain("Report")
                elif self._view.door.reporting() == one.name:
                    push_button("Being made", lambda: None).set_enabled(False)
                else:
                    push_button("Make report", lambda: self._make(one)).set_enabled(self._may(one))
                for bag in one.bags if not one.busy else ():
                    number = f" {one.bags.index(bag) + 1}" if len(one.bags) > 1 else ""
                    link = ui.element("a").classes("button plain-button")
                    # A bag may have any name: within the text of props some would raise.
                    link.props["href"] = f"/runs/{one.name}/{bag}"
                    link.props["download"] = f"{one.name}_{bag}"
                    with link:
                        plain(f"Download{number}")
                push_button("Rename", lambda: self._rename(one)).set_enabled(self._may(one))
                push_button("Delete", lambda: self._delete(one)).set_enabled(self._may(one))

    def _may(self, one: Run) -> bool:
        return self._view.is_operator and bool(one.bags) and not one.busy

    async def _make(self, one: Run) -> None:
        """Make a report; this takes as long as it takes, and the list shows it."""
        title = f"Report of {one.name}"
        number = self._view.desk.begin(self._view.session.page, title, title)
        try:
            bag = await run.io_bound(bag_of, self._folder, one.name)
        except RunFolderError as error:
            self._view.desk.ended(number, Answer(False, str(error)))
            return
        if bag is None:  # the server ends
            return
        self._view.desk.ended(number, await self._view.door.report(bag))
        await self._look()

    async def _rename(self, one: Run) -> None:
        with self._questions:
            name = await ask_name(one.name)
        if name and name != one.name:
            await self._change("Rename", f"{one.name} is {name} now", rename_run, one.name, name)

    async def _delete(self, one: Run) -> None:
        with self._questions:
            sure = await ask_delete(one)
        if sure:
            await self._change("Delete", f"{one.name} is deleted", delete_run, one.name)

    async def _change(self, what: str, done: str, change: object, *names: str) -> None:
        """Change the folder, if this page is in control; say what became of it."""
        refused = self._view.desk.refusal(self._view.session.page)
        if refused:
            self._view.tell(Answer(False, refused), f"{what} {names[0]}")
            return
        try:
            await run.io_bound(change, self._folder, *names)  # type: ignore[arg-type]
        except RunFolderError as error:
            self._view.tell(Answer(False, str(error)), f"{what} {names[0]}")
        else:
            self._view.tell(Answer(True, done), f"{what} {names[0]}")
        await self._look()
