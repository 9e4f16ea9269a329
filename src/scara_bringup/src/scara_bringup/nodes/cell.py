"""``rosrun scara_bringup cell up|demo``: start roscore and all nodes, watch them, end all of them.

Parameters are command line options (``--help``). It publishes nothing and offers no service. The
decisions are in :mod:`scara_bringup.supervisor`, what carries them out in
:mod:`scara_bringup.nodes.cell_shell`.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from scara_config import ConfigError, config_directory, load_robot
from scara_config.profile import CHOICE, PLANT_CHOICE, plant_path
from scara_ros.io.hardening import harden_process

from scara_bringup.config import load_bringup, load_doors
from scara_bringup.io import screen
from scara_bringup.io.configuration import copy_with_ports
from scara_bringup.io.forked import WarmParent, WarmParentError
from scara_bringup.io.master import MasterProbe
from scara_bringup.io.output import link_latest, make_output, runs_of
from scara_bringup.io.preflight import (
    CannotStartError,
    check_before_start,
    namespace,
    node_address,
)
from scara_bringup.io.processes import Processes
from scara_bringup.nodes.cell_shell import CellShell
from scara_bringup.plan import NodePlan, cell_plan, experiment_plan

app = typer.Typer(
    add_completion=False, no_args_is_help=True, help=__doc__.split("\n\n")[0], rich_markup_mode=None
)

RobotName = Annotated[
    str | None, typer.Option("--robot", help="Its folder in config/robots. Default: fanuc_sr6ia.")
]
PlantName = Annotated[
    str | None,
    typer.Option(
        "--plant", help="How the robot's stand-in behaves: ideal or field. Default: ideal."
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(help="Folder of logs, bags and report. Default: runs/<time> of the workspace."),
]
Runs = Annotated[
    Path | None,
    typer.Option(
        help="Folder of all runs: recordings go nowhere else. Default: runs of the workspace if "
        "--output lies in it, else --output."
    ),
]
Without = Annotated[
    list[str] | None,
    typer.Option(help="Leave out a node, e.g. the emulator when a real robot is there."),
]
MasterPort = Annotated[
    int | None, typer.Option(help="Port of the ROS master. Default: ROS_MASTER_URI.")
]
ModbusPort = Annotated[
    int | None, typer.Option(help="Port of the robot stand-in. Default: emulator.yaml.")
]
Network = Annotated[
    bool,
    typer.Option(
        help="Let ROS_IP or ROS_HOSTNAME open the nodes to the network. Without it: 127.0.0.1 only."
    ),
]
PanelPort = Annotated[
    int | None, typer.Option(help="Port of the operator page. Default: operator_panel.yaml.")
]
GatewayPort = Annotated[
    int | None, typer.Option(help="Port of the twin's web socket. Default: gateway.yaml.")
]


@app.command()
def up(
    robot: RobotName = None,
    plant: PlantName = None,
    output: Output = None,
    runs: Runs = None,
    without: Without = None,
    master_port: MasterPort = None,
    modbus_port: ModbusPort = None,
    gateway_port: GatewayPort = None,
    panel_port: PanelPort = None,
    network: Network = False,
) -> None:
    """Start the cell and keep it until Ctrl-C."""
    choose_address(network)
    choose_robot(robot)
    choose_plant(plant)
    folder = prepare(output)
    raise typer.Exit(
        run(
            folder,
            None,
            tuple(without or ()),
            master_port,
            modbus_port,
            gateway_port,
            panel_port,
            True,
            runs,
        )
    )


@app.command()
def demo(
    robot: RobotName = None,
    plant: PlantName = None,
    output: Output = None,
    speed: Annotated[
        float | None, typer.Option(help="Program speed in percent. Default: experiments.yaml.")
    ] = None,
    without: Without = None,
    master_port: MasterPort = None,
    modbus_port: ModbusPort = None,
    gateway_port: GatewayPort = None,
    network: Network = False,
) -> None:
    """Start the cell, run the article's two experiments, write the report, end the cell."""
    choose_address(network)
    choose_robot(robot)
    choose_plant(plant)
    folder = prepare(output)
    if output is None:
        link_latest(folder)
    arguments = () if speed is None else ("--speed", f"{speed:g}")
    experiments = experiment_plan(str(folder), ("real_leads", "twin_leads"), arguments)
    raise typer.Exit(
        run(folder, experiments, tuple(without or ()), master_port, modbus_port, gateway_port)
    )


def run(
    folder: Path,
    foreground: NodePlan | None,
    without: tuple[str, ...],
    master_port: int | None,
    modbus_port: int | None,
    gateway_port: int | None,
    panel_port: int | None = None,
    with_panel: bool = False,
    runs: Path | None = None,
) -> int:
    """Start, watch and end one cell; return the exit code."""
    try:
        if master_port is not None:
            os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{master_port}"
        if (modbus_port, gateway_port, panel_port) != (None, None, None):
            copied = copy_with_ports(
                config_directory(), folder / "config", modbus_port, gateway_port, panel_port
            )
            os.environ["SCARA_CONFIG_DIR"] = str(copied)
        os.environ["ROS_HOME"] = str(folder / "ros_home")
        deadlines, doors = load_bringup(), load_doors()
        nodes = cell_plan(doors, without, with_panel, str(runs_of(folder, runs)))
        master = MasterProbe(os.environ["ROS_MASTER_URI"])
        own_master = check_before_start(nodes, master)
        with (
            WarmParent({**os.environ, "PYTHONUNBUFFERED": "1"}) as warm,
            Processes(folder / "log", os.environ, warm) as processes,
        ):
            shell = CellShell(processes, master, deadlines, doors, folder)
            return shell.run(nodes, foreground, own_master)
    except ConfigError as error:
        screen.complain(str(error))
        return 2
    except (CannotStartError, WarmParentError, ValueError) as error:
        screen.complain(str(error))
        return 1


def choose_address(network: bool) -> None:
    """Keep every program of the cell to this machine and to one spelling of its namespace.

    End with the reason if that cannot be.
    """
    try:
        os.environ.update(node_address(os.environ, network))
        os.environ["ROS_NAMESPACE"] = namespace()
    except CannotStartError as error:
        screen.complain(str(error))
        raise typer.Exit(1) from error


def choose_robot(name: str | None) -> None:
    """Choose the robot for every program of the cell, or end with the reason why not."""
    try:
        if name is not None:
            os.environ[CHOICE] = name
        held = load_robot().name
        if name not in (None, held):
            raise ConfigError(f"--robot {name}: {config_directory()} holds {held} only")
    except ConfigError as error:
        screen.complain(str(error))
        raise typer.Exit(2) from error


def choose_plant(name: str | None) -> None:
    """Choose how the robot's stand-in behaves, or end with the reason why not."""
    try:
        if name is not None:
            os.environ[PLANT_CHOICE] = name
        plant_path()
    except ConfigError as error:
        screen.complain(str(error))
        raise typer.Exit(2) from error


def prepare(wanted: Path | None) -> Path:
    """Create the folder of this run, or end with the reason why not."""
    try:
        return make_output(wanted)
    except OSError as error:
        screen.complain(f"{error.filename}: cannot be used as output: {error.strerror}")
        raise typer.Exit(1) from error


def main() -> None:
    """Run the command line; the process outlives a full disk behind its screen."""
    harden_process()
    sys.argv[0] = "cell"
    app()
