"""Recordings: start, stop, the list of runs, a report in the page."""

from __future__ import annotations

from pathlib import Path

from nicegui import run, ui

from operator_panel.control.fields import error_text, parse_run_name
from operator_panel.door import Answer
from operator_panel.io.page.view import PageView, plain
from operator_panel.io.run_folders import list_runs
from operator_panel.runs import Run
from operator_panel.view.snapshot import Snapshot

REFRESH_S = 3.0


def build_recordings(view: PageView, folder: Path) -> None:
    """Build the form and the list."""
    _Recordings(view, folder)


class _Recordings:
    def __init__(self, view: PageView, folder: Path) -> None:
        self._view, self._folder = view, folder
        self._listed: list[Run] | None = None
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
        with ui.dialog().props("maximized") as self._dialog, ui.element("div").classes("report"):
            with ui.element("div").classes("report-head"):
                self._title = ui.label("").classes("card-title")
                ui.button("Close", on_click=self._dialog.close, color=None).props(
                    "unelevated no-caps dense"
                ).classes("button")
            self._frame = (
                ui.element("iframe")
                .classes("report-frame")
                .props('sandbox="allow-same-origin" title="Report"')
            )
        view.after.append(self._refresh)
        ui.timer(REFRESH_S, self._look)
        ui.timer(0.1, self._look, once=True)

    async def _start(self) -> None:
        if not self._name.validate():
            return
        name = parse_run_name(self._name.value)
        await self._do(
            "Recording",
            self._view.door.record(str(self._folder / name / "run.bag") if name else ""),
        )

    async def _stop(self) -> None:
        await self._do("Recording", self._view.door.stop_recording())

    async def _do(self, what: str, call: object) -> None:
        refused = self._view.desk.refusal(self._view.session.page)
        if refused:
            call.close()  # type: ignore[attr-defined]
            self._view.tell(Answer(False, refused), what)
            return
        answer: Answer = await call  # type: ignore[misc]
        self._view.tell(answer, what)
        await self._look()

    def _refresh(self, snapshot: Snapshot, _: bool) -> None:
        found = [d for name, d in snapshot.diagnoses.items() if name.endswith("recorder")]
        self._status.set_text(
            f"Recorder: {found[0].message}" if found else "Recorder: not heard of yet"
        )

    async def _look(self) -> None:
        found = await run.io_bound(list_runs, self._folder)
        if found is None or found == self._listed:
            return
        self._listed = found
        self._list.clear()
        with self._list:
            if not found:
                plain("No runs yet.", "hint")
            for one in found:
                self._line(one)

    def _line(self, one: Run) -> None:
        with ui.element("div").classes("row-line"):
            ui.label(one.name).classes("row-name")
            ui.label(
                f"{one.when}, {one.size}" + (f"; {one.verdict}" if one.verdict else "")
            ).classes("row-text")
            button = ui.button("Report", on_click=lambda: self._open(one), color=None).props(
                "unelevated no-caps dense"
            )
            button.classes("button").set_enabled(one.has_report)

    def _open(self, one: Run) -> None:
        self._title.set_text(f"Report of {one.name}")
        self._frame.props(f'src="/runs/{one.name}/report.html"')
        self._dialog.open()
