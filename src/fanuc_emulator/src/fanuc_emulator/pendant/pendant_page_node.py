"""The robot's teach pendant as a page, for the person who stands at the robot.

It talks only Modbus.

The operator's page belongs to the cell, this one to the robot's vendor: programs, override, hold,
reset, and troubles to inject. Options: ``--host``, ``--port`` of the robot (default:
emulator.yaml), ``--page-host``, ``--page-port`` (default: pendant_page.yaml), ``--config-dir``.

It listens at once, and loads the page when somebody connects for the first time.

Only who brings the token gets the page, for it starts programs: PENDANT_PAGE_TOKEN of the
environment, else the file pendant_token in ROS_HOME, made if missing.

Example:
    rosrun fanuc_emulator pendant_page --page-port 8090
"""

from __future__ import annotations

import select
import signal
import socket
import sys
from typing import Annotated

import typer
from scara_config import ConfigError, load_robot
from scara_config.modbus_map import load_modbus_map
from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_token_io import (
    PageError,
    listen,
    page_token,
    refuse_token_in,
    ros_home,
    shown_address,
)
from scara_ros.page.token_file_io import TokenError
from scara_ros.shell.command_line_io import CommandLine, ConfigDir
from scara_ros.shell.program_io import WRONG

from fanuc_emulator.config import load_emulator, load_pendant_page, load_programs
from fanuc_emulator.pendant.pendant_node import Host, Port

TOKEN_VARIABLE, TOKEN_FILE = "PENDANT_PAGE_TOKEN", "pendant_token"


app = CommandLine("pendant_page", dict.fromkeys((ConfigError, PageError, TokenError), WRONG))


@app.command()
def serve(
    host: Host = None,
    port: Port = None,
    page_host: Annotated[
        str | None, typer.Option(help="Address of the page; default: pendant_page.yaml.")
    ] = None,
    page_port: Annotated[
        int | None,
        typer.Option(help="Port of the page; default: pendant_page.yaml.", min=1, max=65535),
    ] = None,
    config_dir: ConfigDir = None,
) -> None:
    """Serve the robot's teach pendant as a page; it finds the robot by itself, now or later."""
    file = ros_home() / TOKEN_FILE
    refuse_token_in(sys.argv[1:], TOKEN_VARIABLE, file)
    place = load_pendant_page(config_dir)
    page_host, page_port = page_host or place.host, page_port or place.port
    token = page_token(TOKEN_VARIABLE, file)
    robot, layout = load_robot(config_dir), load_modbus_map(config_dir)
    config, programs = load_emulator(robot, config_dir), load_programs(robot, config_dir)
    listener = listen(page_host, page_port)
    # A page that is served ends by them too: uvicorn raises them again when it has ended.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: sys.exit(0))
    print(f"pendant_page: {shown_address(page_host, page_port, token, file)}", flush=True)
    woken, wake = socket.socketpair()
    with listener, woken, wake:
        # A signal that comes right before the call does not end it: it must have something to read.
        wake.setblocking(False)
        signal.set_wakeup_fd(wake.fileno())
        # Who connects is answered once the page is loaded.
        select.select([listener, woken], [], [])
        signal.set_wakeup_fd(-1)
        from fanuc_emulator.pendant.pendant_station_io import PendantStation
        from fanuc_emulator.pendant.pendant_view_io import PendantPage, serve_page

        with PendantStation(host or config.host, port or config.port, layout, robot) as station:
            title = robot.name.replace("_", " ")
            page = PendantPage(station, programs, title, layout.shows_mode)
            door = PageDoor("pendant_page", page_host, page_port, token)
            serve_page(listener, page, door, f"{robot.name}: pendant")


main = app.run
