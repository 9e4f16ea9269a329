"""The page as a whole: where its parts stand, which files the browser gets, who may do what."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nicegui import Client, app, ui
from scara_config import Robot
from scara_config.profile import PROGRAM_ENDING
from scara_ros.page.page_guard_io import KNOWN, PERSON
from scara_ros.page.page_library_io import WebFolder, offer, plain, tabs_of
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response

from operator_panel.config import PanelConfig, Surroundings
from operator_panel.control.authority import Role
from operator_panel.control.desk_io import PageDesk
from operator_panel.door import CellDoor
from operator_panel.page.charts_io import build_charts
from operator_panel.page.header_io import build_header
from operator_panel.page.jogging_io import build_jog
from operator_panel.page.picture.look_back_io import build_time_line
from operator_panel.page.picture.scene_io import build_scene
from operator_panel.page.preview.motion_line_io import build_motion_line
from operator_panel.page.records.recordings_io import build_recordings
from operator_panel.page.status_io import build_alarms, build_events, build_joints
from operator_panel.page.target_io import build_target
from operator_panel.page.tuning_io import build_tuning
from operator_panel.page.view_io import PageView, live
from operator_panel.page.work.course_io import build_course
from operator_panel.page.work.draft_files_io import FILE
from operator_panel.page.work.programs_io import build_programs
from operator_panel.page.work.robot_io import build_robot, build_today
from operator_panel.page.work.teach_io import build_teach
from operator_panel.retelling.run_folders_io import file_of
from operator_panel.teach.kept_io import Lesson
from operator_panel.view.live_io import PATH, Live
from scara_description.urdf import Model

TABS = (
    *("Jog", "Target", "Programs", "Teach", "Charts"),
    *("Robot", "Tuning", "Recordings", "Events", "Today"),
)


SANDBOX = "sandbox allow-scripts allow-modals allow-downloads"


class Shell:
    """Serves the page, its files and the reports."""

    def __init__(
        self,
        robot: Robot,
        model: Model,
        config: PanelConfig,
        around: Surroundings,
        door: CellDoor,
        desk: PageDesk,
        live: Live,
        web: Path,
        runs: Path,
        lesson: Lesson,
    ) -> None:
        """Offer all routes; ``ui.run`` serves them."""
        self._robot, self._model, self._config, self._around = robot, model, config, around
        self._door, self._desk, self._live = door, desk, live
        self._runs, self._lesson = runs, lesson
        self._web = WebFolder("/panel", web)
        offer("/runs/{run}/{file}", self._report)
        offer(FILE, self._draft)
        app.add_exception_handler(404, _nothing_here)
        ui.page("/", title=f"{robot.name}: operator", response_timeout=10.0)(self._page)

    def _page(self, client: Client, request: Request) -> None:
        """Build one page; the guard before this server knows who has brought the token."""
        role = Role.OPERATOR if request.scope[KNOWN] else Role.VIEWER
        session = self._desk.open(client.id, role, request.scope[PERSON])
        view = PageView(self._robot, self._config, self._around, self._door, self._desk, session)
        view.read_frames()
        build_header(view, self._robot.name.replace("_", " "))
        with ui.element("main").classes("grid"):
            with ui.element("div").classes("pillar stage"):
                scene = build_scene(self._model, view)
                # What is looked at ahead or back docks below the picture, and covers no robot.
                with ui.element("div").classes("dock"):
                    build_time_line()
                    build_motion_line()
                    build_joints(view)
            with ui.element("div").classes("pillar pillar-right"):
                build_commands(view)
                build_alarms()
                build_course(self._runs)
                with ui.element("section").classes("card tabs-card"):
                    charts = self._tabs(view)
        jog_period_ms = 1e3 / self._config.jog.rate_hz
        told = {
            "scene": scene,
            "charts": charts,
            "operator": view.is_operator,
            "jog_period_ms": jog_period_ms,
        }
        panel = json.dumps({**told, "page": client.id, "live": PATH})
        ui.add_body_html(f"<script>window.PANEL = {panel}</script>")
        self._web.add("panel.css", "main.js")
        self._live.listeners.append(view.refresh)
        # Else a page that is gone would be refreshed for ever, and never be freed.
        client.on_delete(lambda: self._live.listeners.remove(view.refresh))

    def _tabs(self, view: PageView) -> dict[str, Any]:
        """Build all tabs; return what the browser needs to feed the charts."""
        tabs_of({name: name for name in TABS}, "tab", "tabs")
        charts: dict[str, Any] = {}
        builders: list[Callable[[PageView], None]] = [
            build_jog,
            build_target,
            lambda view: build_programs(view, self._lesson),
            lambda view: build_teach(view, self._lesson),
            lambda view: charts.update(build_charts(view)),
            build_robot,
            build_tuning,
            lambda view: build_recordings(view, self._runs),
            build_events,
            build_today,
        ]
        for name, build in zip(TABS, builders, strict=True):
            with ui.element("div").classes("tab-panel").props(f'role=tabpanel data-panel="{name}"'):
                build(view)
        return charts

    def _draft(self) -> Response:
        """Serve the program that is being taught, as the file that the robot takes."""
        draft = self._lesson.draft
        name = f'attachment; filename="{draft.program.name}{PROGRAM_ENDING}"'
        head = {"Content-Disposition": name, "Cache-Control": "no-store"}
        return PlainTextResponse(draft.text, headers=head)

    def _report(self, run: str, file: str) -> Response:
        """Serve a report's page, pictures and bag; nothing else of a run leaves the machine."""
        path = file_of(self._runs, run, file)
        if path is None:
            return PlainTextResponse("there is no such file", status_code=404)
        # Whoever opens a report alone opens it without our origin: its scripts reach no button.
        return FileResponse(path, headers={"Content-Security-Policy": SANDBOX})


async def _nothing_here(_: Request, __: Exception) -> Response:
    """Answer for a path that leads nowhere: nicegui's own would build a page."""
    return PlainTextResponse("there is nothing here", status_code=404)


def build_commands(view: PageView) -> None:
    """Build the commands, of which the next one is set off, and the speed."""
    with ui.element("section").classes("card commands-card").props('data-tone="next"'):
        live("next", "next-step", "p")
        with ui.element("div").classes("commands"):
            for command in (
                "PAUSE",
                "STANDSTILL",
                "RESUME",
                "RESET",
                "HOME",
                "ALIGN",
                "ACKNOWLEDGE",
            ):
                view.button(command.capitalize(), command, f"next-{command}")
        with ui.element("div").classes("speed-fact"):
            plain("Speed", "fact-title")
            live("speed.applied", "num").props('data-tone="speed.applied"')
            live("speed.reason", "speed-reason")
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
