"""``rosrun scara_bringup cell up|demo|status|why|install``: start, watch and end a cell, or look.

Parameters are command line options (``--help``). It publishes nothing and offers no service. The
decisions are in :mod:`scara_bringup.supervisor`, what carries them out in
:mod:`scara_bringup.cell_shell_node`. Exit code: 0 all went well, 1 it did not, 2 wrong
configuration or options; that of a node that died; 128 and the number of the signal that ended it.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from scara_config import ConfigError, config_directory, load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import CHOICE, PLANT_CHOICE, chosen_plant, plant_path
from scara_config.readers import check_files
from scara_config.rollout.kept import apply_change, kept_file
from scara_ros.names import cell_of
from scara_ros.shell.program_io import FAILED, WRONG, link_latest
from scara_ros.starting.xmlrpc_guard_io import harden_process

from scara_bringup.cell_shell_node import CellShell, Shown
from scara_bringup.config import Ports, load_bringup, load_coupled, load_doors
from scara_bringup.named.install_node import install_cell
from scara_bringup.named.named_node import ask_why, refuse_second, refuse_without_room, take_turn
from scara_bringup.named.naming import SERVED_BY, free_ports, namespace_by_name
from scara_bringup.named.turn_io import StartTurn
from scara_bringup.options_node import (
    Anyway,
    Browser,
    Farm,
    GatewayPort,
    MasterPort,
    ModbusPort,
    Name,
    Network,
    OfCell,
    Output,
    PanelPort,
    PendantPort,
    PlantName,
    RobotName,
    Runs,
    Speed,
    TwinOnly,
    Without,
)
from scara_bringup.plan import NOT_OF_THE_TWIN, PANEL, PENDANT_PAGE, cell_plan, experiment_plan
from scara_bringup.processes.configuration_io import (
    begin_with_change,
    copy_with_ports,
    got_ready,
    link_taught,
)
from scara_bringup.processes.forked_io import WarmParent, WarmParentError
from scara_bringup.processes.master_io import MasterProbe
from scara_bringup.processes.output_io import make_output, runs_of
from scara_bringup.processes.ports_io import listening_ports
from scara_bringup.processes.preflight_io import (
    CannotStartError,
    check_before_start,
    namespace,
    node_address,
    refuse_two_robots,
)
from scara_bringup.processes.processes_io import Processes
from scara_bringup.processes.warm_parent_io import PAGES
from scara_bringup.terminal import screen_io as screen

REPORT = "report.html"

app = typer.Typer(
    add_completion=False, no_args_is_help=True, help=__doc__.split("\n\n")[0], rich_markup_mode=None
)


@dataclass(frozen=True)
class Wishes:
    """What a cell is to be, as its options say.

    Attributes:
        robot, plant: Their names; None: as the environment says.
        output, runs: Folders; None: the usual ones.
        without: Nodes to leave out.
        master_port: Of the ROS master; None: as ROS_MASTER_URI says.
        ports: Of the servers.
        network: Whether the nodes may be open to the network.
        people: Whether it is a cell for people, with pages.
        browser: Whether the operator's page is opened.
        farm: Whether it has a link to the farm.
        experiments: What is run before the cell ends; empty: it stays.
        arguments: Of these.
        name: Of the cell; None: it has none, and takes the ports of the files.
        anyway: Whether a cell with a name is started on a machine without room, too.
    """

    robot: str | None
    plant: str | None
    output: Path | None
    without: tuple[str, ...]
    master_port: int | None
    ports: Ports
    network: bool
    runs: Path | None = None
    people: bool = False
    browser: bool = False
    farm: bool = False
    experiments: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()
    name: str | None = None
    anyway: bool = False


@app.command()
def up(
    robot: RobotName = None,
    plant: PlantName = None,
    output: Output = None,
    runs: Runs = None,
    without: Without = None,
    twin_only: TwinOnly = False,
    master_port: MasterPort = None,
    modbus_port: ModbusPort = None,
    gateway_port: GatewayPort = None,
    panel_port: PanelPort = None,
    pendant_port: PendantPort = None,
    browser: Browser = True,
    network: Network = False,
    farm: Farm = False,
    name: Name = None,
    anyway: Anyway = False,
) -> None:
    """Start the cell and keep it until Ctrl-C."""
    ports = Ports(modbus_port, gateway_port, panel_port, pendant_port)
    wishes = Wishes(
        robot,
        plant,
        output,
        (*(without or ()), *(NOT_OF_THE_TWIN if twin_only else ())),
        master_port,
        ports,
        network,
        runs,
        people=True,
        browser=browser,
        farm=farm,
        name=name,
        anyway=anyway,
    )
    raise typer.Exit(run(wishes)[0])


@app.command()
def demo(
    robot: RobotName = None,
    plant: PlantName = None,
    output: Output = None,
    speed: Speed = None,
    without: Without = None,
    master_port: MasterPort = None,
    modbus_port: ModbusPort = None,
    gateway_port: GatewayPort = None,
    network: Network = False,
) -> None:
    """Start the cell, run the article's two experiments, write the report, end the cell."""
    ports = Ports(modbus_port, gateway_port)
    wishes = Wishes(
        robot,
        plant,
        output,
        tuple(without or ()),
        master_port,
        ports,
        network,
        experiments=("real_leads", "twin_leads"),
        arguments=() if speed is None else ("--speed", f"{speed:g}"),
    )
    code, folder = run(wishes)
    # Only a run that has come to its report is the latest one.
    if output is None and folder is not None and (folder / REPORT).is_file():
        link_latest(folder)
    raise typer.Exit(code)


@app.command()
def status(
    name: OfCell = None,
    commands: bool = typer.Option(
        False, "--commands", help="Show what starts each node by hand, and its log."
    ),
) -> None:
    """Show the nodes of each running cell: alive, processor time, memory, what they say."""
    from scara_bringup.status.status_node import show_status  # a node, which a cell is not yet here

    raise typer.Exit(show_status(commands, name))


@app.command(context_settings={"allow_interspersed_args": True})
def install(
    name: Annotated[str, typer.Argument(help="Of the cell, as for --name.")],
    robot: RobotName = None,
    plant: PlantName = None,
    without: Without = None,
    farm: Farm = False,
    machine: Annotated[
        bool, typer.Option("--machine", help="A unit of the machine, for who calls; needs root.")
    ] = False,
    folder: Annotated[
        Path | None, typer.Option(help="Where the unit goes. Default: systemd's own place.")
    ] = None,
    remove: Annotated[bool, typer.Option("--remove", help="Remove the unit.")] = False,
) -> None:
    """Write a service unit, so that a cell comes back after a reboot; nothing is enabled."""
    options = [] if robot is None else ["--robot", robot]
    options += [] if plant is None else ["--plant", plant]
    options += [word for left_out in without or () for word in ("--without", left_out)]
    options += ["--farm"] if farm else []
    raise typer.Exit(install_cell(name, options, machine, folder, remove))


@app.command(
    add_help_option=False,
    context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
)
def why(context: typer.Context) -> None:
    """Tell what stopped a cell and why, from its journal (./cell why --help)."""
    raise typer.Exit(ask_why(context.args))


def run(wishes: Wishes) -> tuple[int, Path | None]:
    """Start, watch and end one cell; return the exit code and the folder of the run, if it began.

    Everything that can be wrong is looked at before anything is started or written.
    """
    turn: StartTurn | None = None
    try:
        os.environ.update(node_address(os.environ, wishes.network))
        if wishes.name is not None:
            os.environ["ROS_NAMESPACE"] = namespace_by_name(wishes.name)
        os.environ["ROS_NAMESPACE"] = namespace()
        robot, plant = choose(wishes.robot, wishes.plant)
        # Without a name too: nobody listens at its ports yet, and another cell would choose them.
        turn = take_turn(wishes.name)
        if wishes.name is not None:
            # The wishes of a cell with a name, with ports that are free
            refuse_second(wishes.name)
            if not wishes.anyway:
                refuse_without_room(wishes.name)
            ports, master = free_ports(
                load_doors(), wishes.ports, wishes.master_port, wishes.without, listening_ports()
            )
            wishes = replace(wishes, ports=ports, master_port=master)
        if wishes.master_port is not None:
            os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{wishes.master_port}"
        doors = wishes.ports.over(load_doors())
        health = load_modbus_map().find("motor_torque") is not None
        nodes = cell_plan(
            doors, wishes.without, wishes.people, with_farm=wishes.farm, with_health=health
        )
        refuse_two_robots(nodes, load_coupled().real.host)
        own_master = check_before_start(nodes, MasterProbe(os.environ["ROS_MASTER_URI"]))
        folder = prepare(wishes.output)
        change = own_configuration(wishes, folder)
        # Tokens of the pages and ROS's own logs go into the folder of this run.
        os.environ["ROS_HOME"] = str(folder / "ros_home")
        shown = Shown("up" if wishes.people else "demo", robot, plant, wishes.browser)
        ready = (turn.end,) if turn is not None else ()
        works = (partial(_note_ready, change),) if change is not None else ()
        shown = replace(shown, on_ready=ready, on_works=works)
        return _run(wishes, folder, shown, own_master), folder
    except ConfigError as error:
        screen.complain(str(error))
        return WRONG, None
    except (CannotStartError, WarmParentError, ValueError) as error:
        screen.complain(str(error))
        return FAILED, None
    finally:
        if turn is not None:
            turn.end()


def _note_ready(change: Path) -> None:
    """Note that the cell has got ready with its change; it runs on where that cannot be kept."""
    try:
        got_ready(change)
    except ConfigError as error:
        screen.complain(
            f"{error}: the cell runs with the change of the farm, and leaves it at its next start, "
            "because nothing says that it got ready; make room or mend the file, then start anew"
        )


def own_configuration(wishes: Wishes, folder: Path) -> Path | None:
    """Let the cell's programs read a copy of the configuration where it is not as the files say.

    Args:
        wishes: Of the cell; only one for people takes a change that was rolled out.
        folder: Of this run.

    Returns:
        Where the cell keeps such a change; None: it has none.

    Raises:
        ConfigError: What is kept cannot be read or written.
    """
    source, change, file = config_directory(), None, None
    if wishes.people:
        cell = cell_of(os.environ["ROS_NAMESPACE"])
        file = kept_file(runs_of(folder, wishes.runs), cell)
        kept = begin_with_change(file, source)
        change = kept.wanted
        if kept.note:
            screen.complain(f"configuration: {kept.note}")
    if wishes.ports or change is not None:
        copied = copy_with_ports(source, folder / "config", wishes.ports)
        if change is not None:
            apply_change(change, source, copied)
            screen.say(f"cell: configuration changed by the farm: {change.text}, by {kept.by}")
        if wishes.people:
            link_taught(source, copied)
        os.environ["SCARA_CONFIG_DIR"] = str(copied)
    return file if change is not None else None


def _run(wishes: Wishes, folder: Path, shown: Shown, own_master: bool) -> int:
    """Run a cell that was found right, in the environment that its nodes inherit."""
    stand_in = SERVED_BY["modbus"] not in wishes.without
    deadlines, doors = load_bringup(), load_doors(stand_in=stand_in)
    runs = str(runs_of(folder, wishes.runs))
    health = load_modbus_map().find("motor_torque") is not None
    if wishes.people and not health:
        screen.say("cell: wear is not watched: the robot's map has no motor_torque")
    nodes = cell_plan(doors, wishes.without, wishes.people, runs, wishes.farm, health)
    foreground = None
    if wishes.experiments:
        foreground = experiment_plan(str(folder), wishes.experiments, wishes.arguments)
    master = MasterProbe(os.environ["ROS_MASTER_URI"])
    os.environ["PYTHONUNBUFFERED"] = "1"
    # What pages share costs half a second and 30 MB, which other cells do not spend.
    has_pages = any(node.name in (PANEL, PENDANT_PAGE) for node in nodes)
    with (
        WarmParent.of_this_process(PAGES if has_pages else ()) as warm,
        Processes(folder / "log", os.environ, warm) as processes,
    ):
        shown = replace(shown, runs=runs, plant=shown.plant if stand_in else "")
        shell = CellShell(processes, master, deadlines, doors, folder, shown)
        return shell.run(nodes, foreground, own_master)


def choose(robot: str | None, plant: str | None) -> tuple[str, str]:
    """Choose robot and plant for every program of the cell, and return their names.

    Raises:
        ConfigError: There is no such robot or plant, or a file of theirs is wrong; the text has a
            line for everything that is.
    """
    if robot is not None:
        os.environ[CHOICE] = robot
    if plant is not None:
        os.environ[PLANT_CHOICE] = plant
    # Asked for its error alone: there is no such plant.
    plant_path()
    if faults := check_files():
        count = "a fault" if len(faults) == 1 else f"{len(faults)} faults"
        lines = "".join(f"\n  {fault}" for fault in faults)
        raise ConfigError(f"{count} in the configuration, nothing was started:{lines}")
    held = load_robot().name
    if robot not in (None, held):
        raise ConfigError(f"--robot {robot}: {config_directory()} holds {held} only")
    return held, chosen_plant()


def prepare(wanted: Path | None) -> Path:
    """Create the folder of this run.

    Raises:
        CannotStartError: It cannot be made.
    """
    try:
        return make_output(wanted)
    except OSError as error:
        raise CannotStartError(
            f"{error.filename}: cannot be used as output: {error.strerror}"
        ) from error


def main() -> None:
    """Run the command line; the process outlives a full disk behind its screen."""
    harden_process()
    sys.argv[0] = "cell"
    app()
