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
``twin_controller/judge``, ``what_if/judge``, ``recorder/start``, ``recorder/stop``, ``gripper``,
``real/put_parts_back``, ``twin/put_parts_back``,
``twin/pid/<joint>/set_parameters``; starts ``rosrun fanuc_emulator pendant`` and
``rosrun twin_experiments report`` and ``rosrun operator_panel retell``.
"""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from scara_config import ConfigError, config_directory, load_robot, package_folder
from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_guard_io import PageGuard
from scara_ros.page.page_library_io import app, background_tasks, ui
from scara_ros.page.page_token_io import address, refuse_token_in, ros_home
from scara_ros.page.persons_io import load_persons, person_tokens
from scara_ros.page.token_file_io import TokenError
from scara_ros.process.memory_io import give_back, keep_for_good
from scara_ros.shell.program_io import WRONG, ends_with, private_parameters, runs_folder
from scara_ros.starting.starting_node import refuse_second_node

from operator_panel.config import PanelConfig, load_panel, load_surroundings
from operator_panel.control.desk_io import Desk
from operator_panel.control.jog import DeadMan
from operator_panel.control.tool_jog import ToolArm
from operator_panel.link.cell_link_node import NODE, CellLink
from operator_panel.page.api_io import offer_camera, offer_events, offer_past
from operator_panel.page.shell_io import Shell
from operator_panel.page.twin_api_io import TwinApi
from operator_panel.retelling.recordings_io import Recordings
from operator_panel.view.frame import FrameMaker
from operator_panel.view.live_io import Live
from operator_panel.view.twin_schema import ROOT
from scara_description.urdf import Model, UrdfError, parse_urdf

TOKEN_VARIABLE, TOKEN_FILE = "OPERATOR_PANEL_TOKEN", "operator_token"
NICENESS = (
    5  # our choice: where processors are short, the cell's loops go before the picture of them
)
KNOCK_PERIOD_S = 0.02
ENDED_S = 0.5  # our choice: so often a thread that waits for a press looks whether the node ends


class StartError(RuntimeError):
    """The page cannot be served; the text says why."""


def main() -> None:
    """Serve until SIGINT or SIGTERM; exit code 2 for a wrong file or a taken port.

    Raises:
        SystemExit: That code, or 1 if a panel of this name runs already.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(
            number, lambda *_: None
        )  # uvicorn ends by them, then raises them again for us
    os.nice(NICENESS)
    kinds = (ConfigError, TokenError, UrdfError, StartError)
    with ends_with("operator_panel", dict.fromkeys(kinds, WRONG)):
        serve(private_parameters(sys.argv[1:]))


def serve(private: dict[str, str]) -> None:
    """Build everything and serve the page.

    Raises:
        ConfigError: A file or parameter is wrong.
        TokenError: The token's file cannot be used.
        UrdfError: The robot description cannot be shown.
        StartError: The address cannot be listened on.
    """
    folder = Path(private.get("config_dir") or config_directory())
    robot = load_robot(folder)
    config, around = load_panel(folder), load_surroundings(robot, folder)
    host, port = private.get("host") or config.host, _port(private.get("port"), config.port)
    file = ros_home() / TOKEN_FILE
    refuse_token_in(sys.argv[1:], TOKEN_VARIABLE, file)
    tokens = person_tokens(load_persons(folder))
    if not tokens:
        raise TokenError("persons.yaml: no person has a token: name a file or set the variable")
    runs = runs_folder(private.get("runs_dir")).resolve()
    model = _model(robot.description)
    _check_free(host, port)
    refuse_second_node(NODE)
    ended = threading.Event()
    link = CellLink(robot, config, around, folder, tokens)
    silent_s = config.silent_ms * 1e-3
    dead_man = DeadMan(robot, around.jog_limit_percent, config.jog.dead_man_ms * 1e-3)
    arm = ToolArm(robot, model, config.jog.tool, around.jog_limit_percent)
    desk = Desk(link, dead_man, arm, around.keep_s, config.let_go_s, silent_s, link.say)
    maker = FrameMaker(robot, model, silent_s, around.alarm_mm)
    live = Live(link, desk, maker, config)
    recordings = Recordings(runs, folder, robot.name, maker, config.chart_window_s)
    TwinApi(link.shadow).offer(app)
    offer_camera(link.picture)
    offer_events(live.events.csv)
    offer_past(live.past, recordings, config.chart_window_s)
    Shell(
        robot,
        model,
        config,
        around,
        link,
        desk,
        live,
        package_folder("operator_panel") / "web",
        runs,
    )
    app.add_middleware(
        PageGuard,
        doors={name: PageDoor(NODE, host, port, token) for name, token in tokens.items()},
        stranger=lambda path: desk.crowded() if path == "/" else "",
        framed="/runs/",
        readable=ROOT,
        readers=frozenset(config.api_origins),
    )

    @app.on_startup
    def start() -> None:
        background_tasks.create(_ending_with(live.run()), name="live")
        background_tasks.create(_ending_with(desk.keep_control()), name="control")
        threading.Thread(target=link.connect, args=(ended,), name="connect", daemon=True).start()
        threading.Thread(
            target=link.keep_stop, args=(ended,), name="keep stop", daemon=True
        ).start()
        threading.Thread(target=_jog, args=(desk, config, ended), name="jog", daemon=True).start()
        # A log file may be read by others: there the token stays in its own file.
        hidden = f"TOKEN, which is in {file} unless it was given"
        shown = {name: token if sys.stdout.isatty() else hidden for name, token in tokens.items()}
        ways = [
            f"{address(host, port, token)} to operate" + (f" as {name}" if len(shown) > 1 else "")
            for name, token in shown.items()
        ]
        text = f"operator_panel is ready: {address(host, port, '')} to watch, {', '.join(ways)}"
        background_tasks.create(_announce(host, port, text), name="announce")

    app.on_shutdown(ended.set)
    app.on_shutdown(recordings.close)
    ui.run(
        host=host,
        port=port,
        title=f"{robot.name}: operator",
        favicon="\N{BLACK SQUARE FOR STOP}",
        dark=None,
        show=False,
        reload=False,
        tailwind=False,
        show_welcome_message=False,
        reconnect_timeout=5.0,
        # 20 small frames a second: packing them would cost more than sending them.
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
    )
    ended.set()


async def _announce(host: str, port: int, text: str) -> None:
    """Say the address once the server answers there.

    The server starts to listen only after its start-up handlers.
    """
    while True:
        try:
            _, writer = await asyncio.open_connection(host, port)
        except OSError:
            await asyncio.sleep(KNOCK_PERIOD_S)
        else:
            writer.close()
            give_back()
            keep_for_good()
            print(text, flush=True)
            return


async def _ending_with(task: Coroutine[Any, Any, None]) -> None:
    """Run what the pages are no use without; an error ends the node."""
    try:
        await task
    except Exception:
        traceback.print_exc()
        os._exit(1)


def _jog(desk: Desk, config: PanelConfig, ended: threading.Event) -> None:
    """Send jog commands on absolute deadlines while a button is held, whatever the pages do.

    Without this thread no button may act, so its end ends the node.
    """
    due, period = time.monotonic(), 1.0 / config.jog.rate_hz
    try:
        while not ended.is_set():
            if not desk.jog_tick():
                desk.wait_for_press(ENDED_S)
                due = time.monotonic()
                continue
            due = max(due + period, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
    except Exception:
        traceback.print_exc()
        os._exit(1)


def _model(file: Path) -> Model:
    try:
        return parse_urdf(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise StartError(f"{file}: cannot be read: {error.strerror}") from error


def _port(given: str | None, default: int) -> int:
    if given is None:
        return default
    if not (given.isdigit() and 1 <= int(given) <= 65535):
        raise ConfigError(f"~port = {given}: allowed is 1..65535")
    return int(given)


def _check_free(host: str, port: int) -> None:
    """Find out now what uvicorn would only log."""
    try:
        with socket.create_server((host, port)):
            pass
    except OSError as error:
        raise StartError(f"{host}:{port} cannot be listened on: {error.strerror}") from error
