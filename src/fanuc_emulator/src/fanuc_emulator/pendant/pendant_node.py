"""The robot's teach pendant as a command; it talks only Modbus.

Example:
    rosrun fanuc_emulator pendant override 100
    rosrun fanuc_emulator pendant run ARTICLE --wait
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from scara_config import ConfigError, Robot, load_robot
from scara_config.modbus_map import load_modbus_map
from scara_ros.shell.command_line_io import CommandLine, ConfigDir
from scara_ros.shell.program_io import FAILED, WRONG

from fanuc_emulator.alarms import Severity
from fanuc_emulator.config import EmulatorConfig, load_emulator, load_programs
from fanuc_emulator.pendant.pendant_link_io import PendantError, PendantLink
from fanuc_emulator.settings import Mode
from fanuc_emulator.tp.executor import ProgramState

app = CommandLine(
    "pendant",
    {ConfigError: WRONG, PendantError: FAILED},
    no_args_is_help=True,
    help="Teach pendant of the robot, over Modbus TCP.",
)
Host = Annotated[str | None, typer.Option(help="Address of the robot; default: emulator.yaml.")]
Port = Annotated[
    int | None, typer.Option(help="TCP port; default: emulator.yaml.", min=1, max=65535)
]
Wait = Annotated[bool, typer.Option("--wait", help="Show the progress and end with the program.")]
RUNNING = ProgramState.RUNNING
_ANSWER_TIMEOUT = 1.0
_POWER_TIMEOUT = 4.0  # B-83284EN/09, figure 3.8: drives are on within 2 s; twice that
_POLL = 0.05


@contextmanager
def _robot(
    host: str | None, port: int | None, config_dir: Path | None
) -> Iterator[tuple[PendantLink, Robot, EmulatorConfig]]:
    """Connect to the robot.

    Raises:
        ConfigError: A file is wrong.
        PendantError: The robot does not answer.
    """
    robot = load_robot(config_dir)
    config = load_emulator(robot, config_dir)
    layout = load_modbus_map(config_dir)
    with PendantLink(host or config.host, port or config.port, layout) as link:
        yield link, robot, config


@app.command()
def run(
    name: str,
    host: Host = None,
    port: Port = None,
    config_dir: ConfigDir = None,
    wait: Wait = False,
) -> None:
    """Start program NAME; it moves at the override in force (10 % after a cold start)."""
    with _robot(host, port, config_dir) as (link, robot, config):
        numbers = {
            program.name: number for number, program in load_programs(robot, config_dir).items()
        }
        numbers[config.rsr_programs[0]] = 1
        if name not in numbers:
            raise PendantError(f"no program {name!r}: there are {', '.join(sorted(numbers))}")
        _check_startable(link)
        link.pulse(f"panel_run{numbers[name]}")

        def runs() -> bool:
            return _state(link) is RUNNING and link.read("program_name") == name

        _expect(link, runs, f"{name} did not start")
        typer.echo(f"{name} started at override {link.read('override_now')[0]} %")
        if wait:
            _follow(link, name)


@app.command()
def hold(host: Host = None, port: Port = None, config_dir: ConfigDir = None) -> None:
    """Decelerate along the path and pause the program."""
    with _robot(host, port, config_dir) as (link, _, _):
        link.set_signal("panel_hold", False)
        _expect(link, lambda: _state(link) is not RUNNING, "the program still runs")
        typer.echo("held")


@app.command()
def resume(host: Host = None, port: Port = None, config_dir: ConfigDir = None) -> None:
    """Let the paused program go on, along the same path."""
    with _robot(host, port, config_dir) as (link, _, _):
        if _state(link) is not ProgramState.PAUSED:
            raise PendantError("no program is paused")
        link.set_signal("panel_hold", True)
        link.pulse("panel_start")
        _expect(link, lambda: _state(link) is RUNNING, "the program did not resume")
        typer.echo("resumed")


@app.command()
def abort(host: Host = None, port: Port = None, config_dir: ConfigDir = None) -> None:
    """Decelerate and end the program."""
    with _robot(host, port, config_dir) as (link, _, _):
        link.pulse("panel_abort")
        _expect(link, lambda: _state(link) is ProgramState.ABORTED, "the program did not end")
        typer.echo("aborted")


@app.command()
def reset(host: Host = None, port: Port = None, config_dir: ConfigDir = None) -> None:
    """Release hold and emergency stop, clear alarms, switch the drives on.

    Nothing moves by itself.
    """
    with _robot(host, port, config_dir) as (link, _, _):
        link.set_signal("panel_imstp", True)
        link.set_signal("panel_hold", True)
        link.pulse("panel_reset")
        _expect(link, lambda: not _fault(link), "the fault stays", _POWER_TIMEOUT)
        typer.echo("ready")


@app.command()
def override(
    percent: Annotated[int, typer.Argument(min=1, max=100)],
    host: Host = None,
    port: Port = None,
    config_dir: ConfigDir = None,
) -> None:
    """Set the general override to PERCENT of every programmed speed."""
    with _robot(host, port, config_dir) as (link, _, _):
        link.write("override", [percent])
        # A client may lower it at once, as beside a zone, and an open fence keeps it low.
        _comes(lambda: link.read("override_now")[0] == percent)
        now = link.read("override_now")[0]
        typer.echo(
            f"override {percent} %"
            + (f" asked for, the robot has {now} %" if now != percent else "")
        )


@app.command()
def mode(
    switch: Annotated[Mode, typer.Argument(help="Where to turn it.")],
    host: Host = None,
    port: Port = None,
    config_dir: ConfigDir = None,
) -> None:
    """Turn the mode switch, and with it the teach pendant's: the robot halts until reset."""
    with _robot(host, port, config_dir) as (link, _, _):
        if not link.mode():
            raise PendantError("this robot's map has no mode_b0: its mode switch is not known")
        link.pulse(f"panel_{switch.lower()}")
        _expect(link, lambda: link.mode() == switch, f"the mode is still {link.mode()}")
        typer.echo(f"mode {switch}")


@app.command()
def status(host: Host = None, port: Port = None, config_dir: ConfigDir = None) -> None:
    """Show positions, program, signals and the active alarm."""
    with _robot(host, port, config_dir) as (link, robot, _):
        console = Console()
        console.print(_joint_table(link, robot))
        state = _state(link).name.lower()
        lit = " ".join(name.upper() for name, on in link.outputs().items() if on)
        for label, text in {
            "program": (
                f"{link.read('program_name') or '-'} line {link.read('program_line')[0]}, {state}"
            ),
            "mode": link.mode() or "-",
            "signals": lit,
            "alarm": link.alarm() or "-",
        }.items():
            console.print(f"{label:8} {text}", highlight=False, markup=False)


def _joint_table(link: PendantLink, robot: Robot) -> Table:
    """Lay out positions and speeds."""
    table = Table(title=f"{robot.name}, override {link.read('override_now')[0]} %")
    table.add_column("joint")
    table.add_column("position", justify="right")
    table.add_column("speed", justify="right")
    table.add_column("unit")
    positions, velocities = link.read("position"), link.read("velocity")
    for joint in robot.joints:
        i = joint.axis_number - 1
        shown = (f"{float(values[i]):.2f}" if values else "-" for values in (positions, velocities))
        table.add_row(joint.name, *shown, f"{joint.unit}, {joint.unit}/s")
    return table


def _check_startable(link: PendantLink) -> None:
    """Raise PendantError with the reason if a program cannot be started now."""
    if _fault(link):
        raise PendantError(f"FAULT is on: {link.alarm()}; remove the cause, then: pendant reset")
    if (state := _state(link)) is not ProgramState.ABORTED:
        raise PendantError(
            f"{link.read('program_name')} is {state.name.lower()}; first: pendant abort"
        )
    if not link.signal("panel_hold"):
        raise PendantError("HELD is on; first: pendant reset")


def _state(link: PendantLink) -> ProgramState:
    """Return whether a program runs; a pendant knows it without the UOP's outputs."""
    return ProgramState(int(link.read("program_state")[0]))


def _fault(link: PendantLink) -> bool:
    """Tell whether an alarm is active that stops."""
    severity = link.read("alarm_severity")
    if severity:
        return int(severity[0]) > Severity.WARN
    # A robot that tells no severity has FAULT among its outputs, or is only followed.
    return link.outputs().get("fault", bool(link.read("alarm_id")[0]))


def _expect(
    link: PendantLink,
    condition: Callable[[], bool],
    failure: str,
    timeout: float = _ANSWER_TIMEOUT,
) -> None:
    """Wait for ``condition``.

    After ``timeout`` [s] raise PendantError with ``failure`` and the active alarm.
    """
    if not _comes(condition, timeout):
        alarm = link.alarm()
        raise PendantError(failure + (f": {alarm}" if alarm else ""))


def _comes(condition: Callable[[], bool], timeout: float = _ANSWER_TIMEOUT) -> bool:
    """Wait for ``condition``, ``timeout`` [s] at most; return whether it came."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL / 5)
    return True


def _follow(link: PendantLink, name: str) -> None:
    """Show the program's line until it ends; raise PendantError if it ends by a fault."""
    shown = None
    while (state := _state(link)) is not ProgramState.ABORTED:
        line = f"{name} line {link.read('program_line')[0]} {state.name.lower()}"
        if line != shown:
            typer.echo(line)
            shown = line
        time.sleep(_POLL)
    if _fault(link):
        raise PendantError(f"{name} ended by {link.alarm()}")
    typer.echo(f"{name} ended")


main = app.run
