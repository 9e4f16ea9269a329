"""Serve the operator's page with a scene in place of a cell: no ROS master, no robot.

    .venv/bin/python tests/harness/page/stage.py PORT FOLDER [ROBOT]

``GET /scene/NAME`` changes the scene; ``GET /jogged?keep=no`` tells what was jogged, and forgets
it; ``GET /answers/hold`` holds back what is said of typed positions until ``/answers/give``;
``GET /begin`` makes it as at its start. Everything else is the page's own.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import shutil
import sys
import threading
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from harness.workspace import ROOT, enter_workspace

enter_workspace()

import msgspec  # noqa: E402
from nicegui import app, background_tasks  # noqa: E402
from operator_panel.config import load_panel, load_surroundings  # noqa: E402
from operator_panel.control.desk_io import PageDesk, Session  # noqa: E402
from operator_panel.control.frame_lessons import jog_axes  # noqa: E402
from operator_panel.control.jog import DeadMan  # noqa: E402
from operator_panel.control.tool_jog import ToolArm  # noqa: E402
from operator_panel.door import Answer, Gains  # noqa: E402
from operator_panel.page.api_io import offer_camera, offer_events, offer_past  # noqa: E402
from operator_panel.page.shell_io import Shell  # noqa: E402
from operator_panel.page.work import leading_io  # noqa: E402
from operator_panel.retelling.recordings_io import Recordings  # noqa: E402
from operator_panel.runs import DRAFTS  # noqa: E402
from operator_panel.teach.draft import empty  # noqa: E402
from operator_panel.teach.history import Edits  # noqa: E402
from operator_panel.teach.kept_io import Lesson  # noqa: E402
from operator_panel.view.frame import FrameMaker  # noqa: E402
from operator_panel.view.judged import JUDGE  # noqa: E402
from operator_panel.view.live_io import Live  # noqa: E402
from operator_panel.view.robot.registers import Entry, entries, with_bit, with_words  # noqa: E402
from operator_panel.view.snapshot import Diagnosis, Snapshot  # noqa: E402
from scara_config import load_robot  # noqa: E402
from scara_config.frames import find_frames  # noqa: E402
from scara_config.modbus_map import load_modbus_map  # noqa: E402
from scara_config.profile import CHOICE  # noqa: E402
from scara_control.errors import ScaraControlError  # noqa: E402
from scara_control.kinematics.scara import Elbow  # noqa: E402
from scara_control.kinematics.tool import tool_kinematics  # noqa: E402
from scara_ros.diagnosis import Level  # noqa: E402
from scara_ros.names import Seat  # noqa: E402
from scara_ros.page.page_door import PageDoor  # noqa: E402
from scara_ros.page.page_guard_io import PageGuard  # noqa: E402
from scara_ros.page.page_library_io import serve_pages  # noqa: E402
from starlette.responses import PlainTextResponse  # noqa: E402

from harness.page.judged import MADE, judged_hit, judged_home  # noqa: E402
from harness.page.scenes import SCENES  # noqa: E402
from scara_description.urdf import parse_urdf  # noqa: E402

TOKEN = "token-of-the-stage"
GAINS = {"position_p": 5200.0, "position_i": 900.0, "position_d": 268.0, "i_clamp": 12.0}


class StageDoor:
    """A cell that says what the scene says, and answers every command with a yes."""

    def __init__(self, folder: Path) -> None:
        """Begin with the pair at rest."""
        self.robot = load_robot(folder)
        self._tool = tool_kinematics(self.robot)
        self._layout = load_modbus_map(folder)
        self.scene, self.holder, self.answered = "ready", "", False
        self.jogged: list[dict[str, float]] = []
        self.answers = asyncio.Event()
        self.answers.set()
        self.sessions: Mapping[str, Session] = {}
        self._begun = time.monotonic()

    def snapshot(self) -> Snapshot:
        """Return the scene now; whoever has commanded last is in control while the page is there.

        Where somebody asks, the first page is the one who is asked.
        """
        snapshot = SCENES[self.scene](self.robot, time.monotonic() - self._begun)
        if snapshot.state is None:
            return snapshot
        there = [session.name for session in self.sessions.values() if session.there]
        asker = "" if self.answered else snapshot.state.asker
        if asker and there:
            self.holder = there[0]
        holder = self.holder if self.holder in there else ""
        state = msgspec.structs.replace(snapshot.state, holder=holder, asker=asker)
        # A test sees by this text that the scene has reached the page.
        state_of_gate = {"gate": "refuse", "made": MADE}
        diagnoses = {**snapshot.diagnoses, JUDGE: Diagnosis(Level.OK, JUDGE, "", math.inf)}
        return msgspec.structs.replace(
            snapshot, state=state, jog=self.scene, diagnoses=diagnoses, **state_of_gate
        )

    def watch(self, watched: bool) -> None:
        """Be as new as ever, whether somebody looks or not."""

    async def command(self, seat: Seat, command: str, **fields: Any) -> Answer:
        """Accept it, but HOME while the pair follows."""
        if command == "HOME" and self.scene != "ready":
            return Answer(False, "HOME: something else leads: STOP first")
        return Answer(True, f"{command}: both are commanded")

    async def control(self, seat: Seat, action: str, moves: bool) -> Answer:
        """Give control to whoever asks; who answers a question has answered it."""
        if action in ("TAKE", "ASK"):
            self.holder = seat.name
        elif action == "RELEASE":
            self.holder = ""
        elif action in ("GIVE", "DENY"):
            self.answered = True
        return Answer(True, "")

    def stop(self, seat: Seat, command: str) -> Awaitable[Answer]:
        """Confirm."""

        async def answer() -> Answer:
            return Answer(True, f"{command}: both are stopped", {"confirmed": True})

        return answer()

    async def judge(self, **fields: Any) -> Answer:
        """Say that every point of the form can be reached, once answers are let through.

        A question without a speed is that of tab Teach: it is answered by the twin's kinematics.
        """
        await self.answers.wait()
        if "speed_percent" not in fields:
            return self._solved(**fields)
        names = [joint.name for joint in self.robot.twin_joints]
        last = fields.get("yaw", 0.5)
        values = {"name": names, "target": [0.5] * (len(names) - 1) + [last], "elbow": "righty"}
        return Answer(True, "", {**values, "refused_now": ""})

    def _solved(self, x: float, y: float, z: float, elbow: str) -> Answer:
        state = self.snapshot().state
        names = [joint.name for joint in self.robot.twin_joints]
        now = [0.0] * len(names)
        if state is not None:
            shown = dict(zip(state.name, state.twin_position))
            now = [shown[joint.name] * joint.scale for joint in self.robot.twin_joints]
        there = dict(zip(names, now))
        seed = [there[joint.name] for joint in self._tool.joints]
        try:
            found = self._tool.inverse(x, y, z, Elbow(elbow) if elbow else None, seed).chosen
        except ScaraControlError as error:
            return Answer(False, str(error), {"name": names, "target": [], "elbow": ""})
        there |= dict(zip((joint.name for joint in self._tool.joints), found.q))
        branch = found.elbow.value if found.elbow else ""
        return Answer(True, "", {"name": names, "target": list(there.values()), "elbow": branch})

    async def try_motion(self, motion: str, **fields: Any) -> Answer:
        """Say that HOME and a draft are free, and that everything else hits a part."""
        await asyncio.sleep(0.0)
        free = motion == "MOVE_JOINTS" or str(fields.get("program")).endswith(".LS")
        return judged_home(self.robot) if free else judged_hit(self.robot)

    async def convert(self, text: str, to: str, frame: int = -1) -> Answer:
        """Hand out what is there."""
        return Answer(True, "P[1] stays in joints: the arm is stretched there", {"text": text})

    async def picture(self, after: str) -> tuple[str, bytes] | None:
        """Have no camera."""
        await asyncio.sleep(0.2)
        return None

    async def record(self, path: str) -> Answer:
        """Record nothing."""
        return Answer(True, f"recording {path}")

    async def stop_recording(self) -> Answer:
        """Have recorded nothing."""
        return Answer(True, "complete")

    async def report(self, bag: Path) -> Answer:
        """Write a page in a report's place, of a bag that is damaged."""
        document = {"experiments": [], "missing": "The recording is damaged. Not read: its end."}
        (bag.parent / "report.json").write_text(json.dumps(document), encoding="utf-8")
        (bag.parent / "report.html").write_text("<h1>Report of the stage</h1>", encoding="utf-8")
        return Answer(True, f"the report of {bag.parent.name} is ready")

    def reporting(self) -> str:
        """Make every report at once."""
        return ""

    def gains(self, joint: str) -> Gains:
        """Return the gains of a joint."""
        return Gains(GAINS, switches={"antiwindup": True})

    async def tune(
        self, joint: str, values: Mapping[str, float], switches: Mapping[str, bool]
    ) -> Answer:
        """Set nothing."""
        return Answer(True, "set")

    async def undo_tuning(self) -> Answer:
        """Undo nothing."""
        return Answer(True, "undone")

    def jog(self, velocities: Mapping[str, float]) -> None:
        """Move nothing, and remember what would move."""
        self.jogged.append(dict(velocities))

    async def grip(self, close: bool, asked: float) -> Answer:
        """Grip nothing."""
        return Answer(True, "the gripper is closed" if close else "the gripper is open")

    async def registers(self) -> tuple[Sequence[Entry], str]:
        """Read zeros everywhere."""
        found = [
            with_words(one, self._layout, [0] * one.count)
            if "registers" in one.table
            else with_bit(one, True)
            for one in entries(self._layout)
        ]
        return found, ""

    async def robot_frames(self) -> Answer:
        """Have the first user frame elsewhere, and a tool that no file takes."""
        away = (50.0, -450.0, -41.5, 0.0, 0.0, 0.0)
        return Answer(True, "", {"frames": {("user", 1): away, ("tool", 12): away}})

    async def put_parts_back(self) -> Answer:
        """Put nothing back."""
        return Answer(True, "the parts of both cells stand where they stood at the start")

    async def pendant(self, *words: str, asked: float, barred: Callable[[], str]) -> Answer:
        """Press nothing."""
        return Answer(True, " ".join(words))


def _jog(desk: PageDesk, period: float) -> None:
    """Send what is held, as the node's own thread does."""
    while True:
        desk.jog_tick()
        time.sleep(period)


def main() -> None:
    """Serve until a signal."""
    port, runs = int(sys.argv[1]), Path(sys.argv[2])
    if len(sys.argv) > 3:
        os.environ[CHOICE] = sys.argv[3]
    folder = runs.parent / "config"
    shutil.copytree(ROOT / "config", folder, dirs_exist_ok=True)
    # No gripper closes here: who waits for one gives up at once.
    leading_io.GRIP_S = 0.2
    door = StageDoor(folder)
    robot, config = door.robot, load_panel(folder)
    around = load_surroundings(robot, folder)
    model = parse_urdf(robot.description.read_text(encoding="utf-8"))
    dead_man = DeadMan(robot, around.jog_limit_percent, config.jog.dead_man_ms * 1e-3)
    axes = jog_axes(find_frames(folder))
    arm = ToolArm(robot, model, config.jog.tool, around.jog_limit_percent, axes)
    desk = PageDesk(door, dead_man, arm, around.keep_s, config.let_go_s, 0.6, lambda _: None)  # type: ignore[arg-type]
    door.sessions = desk.sessions
    maker = FrameMaker(robot, model, 0.6, around.alarm_mm)
    live = Live(door, desk, maker, config)  # type: ignore[arg-type]
    offer_camera(door.picture)
    offer_events(live.events.csv)
    recordings = Recordings(runs, folder, robot.name, maker, config.chart_window_s)
    offer_past(live.past, recordings, config.chart_window_s)
    web = ROOT / "src" / "operator_panel" / "web"
    lesson = Lesson(runs / DRAFTS, robot)
    Shell(robot, model, config, around, door, desk, live, web, runs, lesson)  # type: ignore[arg-type]

    async def choose(name: str) -> PlainTextResponse:
        door.scene, door.answered = name, False
        return PlainTextResponse(name)

    async def begin() -> PlainTextResponse:
        door.scene, door.answered, door.holder = "ready", False, ""
        door.jogged = []
        shutil.rmtree(folder)
        shutil.copytree(ROOT / "config", folder)
        lesson.history = Edits(empty("TAUGHT", robot), version=lesson.history.version + 1)
        door.answers.set()
        return PlainTextResponse("ready")

    async def jogged(keep: bool) -> list[dict[str, float]]:
        told = door.jogged
        door.jogged = told if keep else []
        return list(told)

    async def answers(what: str) -> PlainTextResponse:
        if what == "hold":
            door.answers.clear()
        else:
            door.answers.set()
        return PlainTextResponse(what)

    app.add_api_route("/answers/{what}", answers, methods=["GET"])
    app.add_api_route("/begin", begin, methods=["GET"])
    app.add_api_route("/scene/{name}", choose, methods=["GET"])
    app.add_api_route("/jogged", jogged, methods=["GET"])
    doors = {"operator": PageDoor("operator_panel", "127.0.0.1", port, TOKEN)}
    app.add_middleware(PageGuard, doors=doors, stranger=lambda _: "", framed="/runs/")

    @app.on_startup
    def start() -> None:
        background_tasks.create(live.run(), name="live")
        background_tasks.create(desk.keep_control(), name="control")
        threading.Thread(target=_jog, args=(desk, 1.0 / config.jog.rate_hz), daemon=True).start()

    # A processor that draws the picture first stands still for longer than the panel waits.
    serve_pages("127.0.0.1", port, "stage", dark=None, reconnect_timeout=20.0)


if __name__ in {"__main__", "__mp_main__"}:
    main()
