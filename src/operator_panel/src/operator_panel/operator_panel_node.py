"""Node ``operator_panel``: the operator's web page.

Parameters (``_name:=value`` on the command line, so that they hold without a ROS master too):
    ~config_dir: Folder with the YAML files; default: the package scara_config.
    ~host, ~port: Address of the page; default: operator_panel.yaml.
    ~runs_dir: Folder of recorded runs; default: runs of CELL_ROOT, else of the working folder.
The persons and their tokens: persons.yaml. As shipped one person, operator: OPERATOR_PANEL_TOKEN of
the environment, else the file operator_token in ROS_HOME, made if missing; never a parameter, which
everybody on the machine can read.
Subscribes: ``twin_controller/state``, ``twin_controller/decisions``, ``real/robot_data``,
``joint_vel_controller/state``, ``/diagnostics``, ``camera/image_raw`` (while a page shows it),
``people/nearest``, ``robot_status``, ``real/part_events``, ``twin/part_events``,
``twin/<joint>_position_controller/state``, ``twin/pid/<joint>/parameter_descriptions``,
``twin/pid/<joint>/parameter_updates``.
Publishes: ``joint_vel_controller/command`` (control_msgs/JointJog) while a jog button is held,
``what_if/gate`` (scara_msgs/Audit) before it starts a program.
Calls: ``twin_controller/command``, ``twin_controller/control``, ``twin_controller/shadow``,
``twin_controller/judge``, ``what_if/judge``, ``what_if/convert``,
``recorder/start``, ``recorder/stop``, ``gripper``, ``real/put_parts_back``,
``twin/put_parts_back``,
``twin/pid/<joint>/set_parameters``; starts ``rosrun fanuc_emulator pendant`` and
``rosrun twin_experiments report`` and ``rosrun operator_panel retell``.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Coroutine, Iterator
from pathlib import Path
from typing import Any

from scara_config import ConfigError, config_directory, load_robot, package_folder
from scara_config.frames import find_frames
from scara_config.palletise import find_palletise
from scara_description.vehicle import with_vehicle
from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_guard_io import PageGuard
from scara_ros.page.page_library_io import app, background_tasks, serve_pages
from scara_ros.page.page_token_io import (
    PageError,
    address,
    listen,
    refuse_token_in,
    ros_home,
    shown_address,
)
from scara_ros.page.persons_io import load_persons, person_tokens
from scara_ros.page.token_file_io import TokenError
from scara_ros.process.memory_io import give_back, keep_for_good
from scara_ros.shell.program_io import WRONG, ends_with, private_parameters, runs_folder
from scara_ros.starting.starting_node import refuse_second_node

from operator_panel.config import PanelConfig, load_panel, load_surroundings
from operator_panel.control.desk_io import PageDesk
from operator_panel.control.frame_lessons import jog_axes
from operator_panel.control.jog import DeadMan
from operator_panel.control.tool_jog import ToolArm
from operator_panel.link.cell_link_node import NODE, CellLink
from operator_panel.page.api_io import offer_camera, offer_events, offer_past
from operator_panel.page.shell_io import Shell
from operator_panel.page.twin_api_io import TwinApi
from operator_panel.retelling.recordings_io import Recordings
from operator_panel.runs import DRAFTS
from operator_panel.teach.kept_io import Lesson
from operator_panel.view.frame import FrameMaker
from operator_panel.view.live_io import Live
from operator_panel.view.twin_schema import ROOT
from scara_description.urdf import UrdfError, parse_urdf

TOKEN_VARIABLE, TOKEN_FILE = "OPERATOR_PANEL_TOKEN", "operator_token"
NICENESS = 5
"""Our choice: where processors are short, the cell's loops go before the picture of them."""
ENDED_S = 0.5  # our choice: so often a thread that waits for a press looks whether the node ends


def main() -> None:
    """Serve until SIGINT or SIGTERM; exit code 2 for a wrong file or a taken port.

    Raises:
        SystemExit: That code, or 1 if a panel of this name runs already.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        # uvicorn ends by them, then raises them again for us
        signal.signal(number, lambda *_: None)
    os.nice(NICENESS)
    kinds = (ConfigError, TokenError, UrdfError, PageError)
    with ends_with("operator_panel", dict.fromkeys(kinds, WRONG)):
        serve(private_parameters(sys.argv[1:]))


def serve(private: dict[str, str]) -> None:
    """Build everything and serve the page.

    Raises:
        ConfigError: A file or parameter is wrong.
        TokenError: The token's file cannot be used.
        UrdfError: The robot description cannot be shown.
        PageError: The address cannot be listened on, or the description cannot be read.
    """
    folder = Path(private.get("config_dir") or config_directory())
    robot = load_robot(folder)
    config, around = load_panel(folder), load_surroundings(robot, folder)
    host, port = private.get("host") or config.host, private.get("port", str(config.port))
    if not (port.isdigit() and 1 <= int(port) <= 65535):
        raise ConfigError(f"~port = {port}: allowed is 1..65535")
    refuse_token_in(sys.argv[1:], TOKEN_VARIABLE, ros_home() / TOKEN_FILE)
    tokens = person_tokens(load_persons(folder))
    if not tokens:
        raise TokenError("persons.yaml: no person has a token: name a file or set the variable")
    try:
        text = robot.description.read_text(encoding="utf-8")
        work = find_palletise(folder)
        model = parse_urdf(with_vehicle(text, work, find_frames(folder)) if work else text)
    except OSError as error:
        raise PageError(f"{robot.description}: cannot be read: {error.strerror}") from error
    doors = {name: PageDoor(NODE, host, int(port), token) for name, token in tokens.items()}
    listen(host, int(port)).close()  # uvicorn would only log that somebody else listens there
    refuse_second_node(NODE)

    # What the page shows and does.
    link = CellLink(robot, config, around, folder, tokens)
    silent_s = config.silent_ms * 1e-3
    dead_man = DeadMan(robot, around.jog_limit_percent, config.jog.dead_man_ms * 1e-3)
    axes = jog_axes(find_frames(folder))
    arm = ToolArm(robot, model, config.jog.tool, around.jog_limit_percent, axes)
    desk = PageDesk(link, dead_man, arm, around.keep_s, config.let_go_s, silent_s, link.say)
    maker = FrameMaker(robot, model, silent_s, around.alarm_mm)
    live = Live(link, desk, maker, config)
    runs = runs_folder(private.get("runs_dir")).resolve()
    recordings = Recordings(runs, folder, robot.name, maker, config.chart_window_s)
    web = package_folder("operator_panel") / "web"
    cell = os.environ.get("ROS_NAMESPACE", "").strip("/") or "cell"
    lesson = Lesson(runs / DRAFTS / cell / robot.name, robot)
    Shell(robot, model, config, around, link, desk, live, web, runs, lesson)

    # What else the browser may ask for, and who may.
    TwinApi(link.shadow).offer(app)
    offer_camera(link.picture)
    offer_events(live.events.csv)
    offer_past(live.past, recordings, config.chart_window_s)
    app.add_middleware(
        PageGuard,
        doors=doors,
        stranger=lambda path: desk.crowded() if path == "/" else "",
        framed="/runs/",
        readable=ROOT,
        readers=frozenset(config.api_origins),
    )
    app.on_shutdown(recordings.close)
    _run(f"{robot.name}: operator", doors, link, desk, live, config)


def _run(
    title: str,
    doors: dict[str, PageDoor],
    link: CellLink,
    desk: PageDesk,
    live: Live,
    config: PanelConfig,
) -> None:
    """Serve, with all threads beside the server, until a signal."""
    ended = threading.Event()
    host, port = next((door.host, door.port) for door in doors.values())

    @app.on_startup
    def start() -> None:
        background_tasks.create(_ending_with(live.run()), name="live")
        background_tasks.create(_ending_with(desk.keep_control()), name="control")
        for name, act in (
            ("connect", lambda: link.connect(ended)),
            ("keep stop", lambda: link.keep_stop(ended)),
            ("jog", lambda: _jog(desk, config, ended)),
        ):
            threading.Thread(target=act, name=name, daemon=True).start()

    def served() -> None:
        give_back()
        keep_for_good()
        ways = [f"{address(host, port, '')} to watch"]
        for name, door in doors.items():
            way = shown_address(host, port, door.token, ros_home() / TOKEN_FILE)
            ways.append(f"{way} to operate" + (f" as {name}" if len(doors) > 1 else ""))
        print(f"operator_panel is ready: {', '.join(ways)}", flush=True)

    app.on_shutdown(ended.set)
    serve_pages(
        host,
        port,
        title,
        served,
        favicon="\N{BLACK SQUARE FOR STOP}",
        dark=None,
        reconnect_timeout=5.0,
        # 20 small frames a second: packing them would cost more than sending them.
        ws_per_message_deflate=False,
    )
    ended.set()


@contextlib.contextmanager
def _vital() -> Iterator[None]:
    """End the node by an error in the body: without it the pages are no use."""
    try:
        yield
    except Exception:
        traceback.print_exc()
        os._exit(1)


async def _ending_with(task: Coroutine[Any, Any, None]) -> None:
    """Run what the pages are no use without."""
    with _vital():
        await task


def _jog(desk: PageDesk, config: PanelConfig, ended: threading.Event) -> None:
    """Send jog commands on absolute deadlines while a button is held, whatever the pages do.

    Without this thread no button may act.
    """
    due, period = time.monotonic(), 1.0 / config.jog.rate_hz
    with _vital():
        while not ended.is_set():
            if not desk.jog_tick():
                desk.wait_for_press(ENDED_S)
                due = time.monotonic()
                continue
            due = max(due + period, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
