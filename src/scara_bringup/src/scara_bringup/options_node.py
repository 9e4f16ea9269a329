"""The options of the cell's commands, each with the range that it allows."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Port = int | None


def _port(text: str) -> typer.models.OptionInfo:
    """Return a port's option."""
    option: typer.models.OptionInfo = typer.Option(help=text, min=1, max=65535)
    return option


RobotName = Annotated[
    str | None, typer.Option("--robot", help="Its folder in config/robots. Default: fanuc_sr6ia.")
]
PlantName = Annotated[
    str | None,
    typer.Option(
        "--plant",
        help="How the robot's stand-in behaves: ideal or field, or one drawn from it by a seed "
        "(field:7). Default: ideal.",
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
TwinOnly = Annotated[
    bool,
    typer.Option(
        "--twin-only", help="Only the twin's side: no robot, no twin controller, no pages."
    ),
]
Name = Annotated[
    str | None,
    typer.Option(
        "--name",
        help="Name of this cell among several, e.g. milk_2: its namespace, its journal. It gets "
        "free ports and a ROS master of its own.",
    ),
]
Anyway = Annotated[
    bool, typer.Option("--anyway", help="Start a cell with a name though no processor is free.")
]
OfCell = Annotated[str | None, typer.Option("--name", help="Of the cell. Default: all that run.")]
Speed = Annotated[
    float | None,
    typer.Option(help="Program speed in percent. Default: experiments.yaml.", min=1, max=100),
]
Network = Annotated[
    bool,
    typer.Option(
        help="Let ROS_IP or ROS_HOSTNAME open the nodes to the network. Without it: 127.0.0.1 only."
    ),
]
Farm = Annotated[
    bool, typer.Option("--farm", help="Show this cell to the farm: ./cell farm is its desk.")
]
Browser = Annotated[
    bool, typer.Option(help="Open the operator's page in a browser, where there is a display.")
]
MasterPort = Annotated[Port, _port("Port of the ROS master. Default: ROS_MASTER_URI.")]
ModbusPort = Annotated[Port, _port("Port of the robot stand-in. Default: emulator.yaml.")]
GatewayPort = Annotated[Port, _port("Port of the twin's web socket. Default: gateway.yaml.")]
PanelPort = Annotated[Port, _port("Port of the operator page. Default: operator_panel.yaml.")]
PendantPort = Annotated[Port, _port("Port of the pendant page. Default: pendant_page.yaml.")]
