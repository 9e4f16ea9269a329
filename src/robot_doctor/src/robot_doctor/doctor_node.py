"""Check a robot profile: rosrun robot_doctor doctor --robot NAME; make one: doctor new NAME.

The article's methodology as checks, in four groups: the robot, its simulation, its registers, the
links. Without ``--move`` nothing is written to the robot. Exit code 0 nothing is wrong, 1 something
is, 2 there is no such profile, or nobody answers ``--stops``. ``doctor --stops`` tries what stops
the robot, one means after the other and each after a question, and offers to write what it saw into
robot.yaml. ``doctor new NAME --from ROBOT`` copies the files of a robot that is there, renames it
in them and writes its URDF; ``doctor new NAME --scara 325 225 --stroke 150 --axes 4 --no-table``
makes those of a SCARA; ``doctor new NAME --urdf FILE`` those of an arm that a URDF describes.
"""

from __future__ import annotations

import contextlib
import datetime
import itertools
import os
from collections.abc import Generator, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from scara_config import ConfigError, Robot, config_directory, load
from scara_config.frames import NO_FRAMES, FrameTable, find_frames
from scara_config.modbus_map import ModbusMap, load_modbus_map, problems
from scara_config.profile import PROGRAMS, chosen_robot, locate
from scara_config.readers import NEEDS_ROBOT, check_files
from scara_config.set_up.settings import connections_needed
from scara_config.set_up.slots import has_slots
from scara_config.writer import write_values
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot
from scara_ros.shell.program_io import WRONG
from twin_controller.config import TwinControllerConfig, load_twin_controller
from twin_controller.modbus.port_io import LinkLostError
from twin_controller.twin.rosbridge_access_io import read_access

from robot_doctor.examine import EXAMPLE, RobotProfile, examine, mend, next_command
from robot_doctor.finding import Finding, Group, Level, is_healthy, note, wrong
from robot_doctor.link_checks import check_answers
from robot_doctor.new_arm_io import make_arm
from robot_doctor.new_profile_io import make_profile, make_scara
from robot_doctor.new_scara import ScaraSize
from robot_doctor.profile_files_io import place_of, read_profile
from robot_doctor.robot_probe_io import Mover
from robot_doctor.set_up_checks import check_set_up
from robot_doctor.set_up_probe_io import ask, probe_set_up
from robot_doctor.stop_trials import TrialEnd, allocation, changes, proposal
from robot_doctor.stop_trials_io import StopTrials, UnexpectedError, answer
from robot_doctor.twin_probe_io import ask_twin

SECONDS = 2.0
PATIENCE_S = 1.0
"""For one answer while the set-up is read: slow is not wrong there."""
STOPS_BEGIN = """\
What stops the robot at {}:{}? Nobody inside the guard, a hand on its emergency stop.
The override goes to 1 % and stays there. Enter leaves a step out; what is neither y nor n ends
all, and the robot is held.
"""
COLOURS = {Level.FINE: "green", Level.NOTE: "yellow", Level.WRONG: "bold red"}
app = CommandLine(
    "doctor",
    {ConfigError: WRONG, LinkLostError: WRONG},
    help="Check a robot profile: robot, simulation, registers, links.",
    rich_markup_mode=None,
)


@app.callback(invoke_without_command=True)
def doctor(
    context: typer.Context,
    robot: RobotName = None,
    host: Annotated[
        str | None, typer.Option(help="The robot; default: twin_controller.yaml.")
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(help="Its Modbus port; default: twin_controller.yaml.", min=1, max=65535),
    ] = None,
    twin_url: Annotated[
        str | None, typer.Option(help="The twin's web socket; default: twin_controller.yaml.")
    ] = None,
    move: Annotated[
        bool, typer.Option("--move", help="Send each joint a hair away and back, and swing it.")
    ] = False,
    stops: Annotated[
        bool, typer.Option("--stops", help="Try what stops the robot, asking before each trial.")
    ] = False,
    offline: Annotated[bool, typer.Option("--offline", help="Look at the files only.")] = False,
    config_dir: ConfigDir = None,
) -> None:
    """Check a robot profile: robot, simulation, registers, links."""
    if context.invoked_subcommand:
        return
    console = Console(highlight=False, soft_wrap=True)
    choose_robot(robot)
    try:
        folder = Path(config_dir or config_directory())
        profile = read_profile(folder)
    except ConfigError as error:
        made = f"rosrun robot_doctor doctor new {chosen_robot()} --from {EXAMPLE}"
        raise ConfigError(f"{error}\n        -> a new robot: {made}") from error
    if stops:
        raise typer.Exit(0 if _stops(console, profile, folder, host, port) else 1)
    findings = list(examine(profile))
    findings += other_files(folder, profile, findings)
    moves = move and is_healthy(findings)
    # What cannot be read of these files, as a keep-out zone, is missing in what would be moved.
    if move and not (moves or offline):
        findings.append(wrong(Group.LINKS, "nothing is moved", "correct the files first"))
    # Closed, also where this is interrupted: it stops the robot.
    with contextlib.closing(_links(profile, folder, host, port, twin_url, moves)) as links:
        found = itertools.chain(findings, () if offline else links)
        findings = show(console, profile, found, folder)
    real, healthy = "", is_healthy(findings)
    if healthy:
        real = load(locate("twin_controller.yaml", folder), TwinControllerConfig).real.host
    then = next_command(chosen_robot(), healthy, real, offline, host, port)
    console.print(f"next: {then}", markup=False)
    raise typer.Exit(0 if healthy else 1)


@app.command()
def new(
    name: Annotated[str, typer.Argument(help="Of the new robot: its folder in config/robots.")],
    source: Annotated[
        str, typer.Option("--from", help="The robot whose files it begins with.")
    ] = EXAMPLE,
    scara: Annotated[
        tuple[float, float] | None,
        typer.Option(help="A SCARA: mm from joint 1 to 2, and from 2 to the tool's axis."),
    ] = None,
    stroke: Annotated[
        float, typer.Option(help="Of a SCARA's joint 3 [mm].", min=20.0, max=1000.0)
    ] = 200.0,
    axes: Annotated[int, typer.Option(help="Of a SCARA: with 4 its tool turns.", min=3, max=4)] = 4,
    table: Annotated[bool, typer.Option("--table/--no-table", help="A SCARA's turntable.")] = True,
    two_tables: Annotated[bool, typer.Option("--two-tables", help="Another on its left.")] = False,
    down: Annotated[bool, typer.Option("--down", help="A SCARA's joint 3 counts down.")] = False,
    urdf: Annotated[Path | None, typer.Option(help="An arm's description, with meshes.")] = None,
    tool: Annotated[
        str | None, typer.Option(help="The link at the end of a URDF's arm; default: tool0.")
    ] = None,
    config_dir: ConfigDir = None,
) -> None:
    """Make the files of a new robot: of one that is there, a SCARA's lengths, or a URDF."""
    console = Console(highlight=False, soft_wrap=True)
    config = Path(config_dir or config_directory())
    if urdf is not None and scara is not None:
        raise ConfigError("--urdf and --scara: give one of them; an arm is made from one")
    if urdf is not None:
        folder = make_arm(config, name, urdf, tool)
        said = "Joints and limits are the URDF's, accelerations and positions are not."
    elif scara is None:
        folder = make_profile(config, name, source)
        said = f"It is {source} under another name."
    else:
        l1, l2 = scara
        tables: Literal[0, 1, 2] = 2 if two_tables else 1 if table else 0
        size = ScaraSize(l1, l2, stroke, 4 if axes == 4 else 3, tables, down)
        folder = make_scara(config, name, size)
        said = "Lengths and stroke are yours, limits and speeds are not."
    for file in sorted(folder.rglob("*.yaml")):
        console.print(f"made {file}", markup=False)
    console.print(
        f"{said} Begin with {folder / 'robot.yaml'}: docs/methodology.md says how.\n"
        f"next: rosrun robot_doctor doctor --robot {name} --offline",
        markup=False,
    )


def other_files(folder: Path, profile: RobotProfile, found: list[Finding]) -> Iterator[Finding]:
    """Yield the faults of all other files that a cell of this robot reads, each told once."""
    told = "\n".join(finding.what for finding in found)
    robot = None if isinstance(profile.robot, ConfigError) else profile.robot
    places = {place_of(f, folder, profile.robot) for f in found if f.level is Level.WRONG} - {""}
    # That the body is another one's was told with the simulation, joint by joint.
    known = any(f.level is Level.WRONG and f.group is Group.SIMULATION for f in found)
    about: tuple[str, ...] = ("robot.yaml: home_pose", "robot.yaml: joints.") if known else ()
    if known and robot is not None:
        about += (f"{robot.urdf}: cannot be read",)
    for fault in check_files(folder, robot):
        file, _, rest = fault.partition(" (line ")[0].partition(": ")
        said = f"{Path(file.partition(', line ')[0]).name}: {rest}"
        # Without robot.yaml this is no fault of the file.
        waits = robot is None and NEEDS_ROBOT in fault
        if said in told or fault.startswith(about) or waits:
            continue
        if profile.axes_occur_twice and f"/{PROGRAMS}/" in file:
            continue
        finding = wrong(Group.FILES, fault, mend(fault, chosen_robot()))
        # A line that was told as wrong is not told again by another reader of it.
        if place_of(finding, folder, profile.robot) not in places:
            yield finding


def tell(console: Console, finding: Finding, place: str = "") -> None:
    """Print one finding, where it is, and what to do."""
    said = f"  {finding.level.value:5} {finding.what}"
    console.print(said, style=COLOURS[finding.level], markup=False)
    if place:
        console.print(f"        at {place}", markup=False)
    if finding.advice:
        console.print(f"        -> {finding.advice}", markup=False)


def show(
    console: Console, profile: RobotProfile, findings: Iterable[Finding], folder: Path
) -> list[Finding]:
    """Print each finding as it comes, where it is, and what to do; return all of them.

    Who stands at a robot that moves has to know it at once.
    """
    name = chosen_robot() if isinstance(profile.robot, ConfigError) else profile.robot.name
    shown: list[Finding] = []
    for finding in findings:
        if not shown or finding.group is not shown[-1].group:
            console.print(f"{finding.group.value}", style="bold", markup=False)
        tell(console, finding, place_of(finding, folder, profile.robot) if finding.advice else "")
        shown.append(finding)
    counts = {level: sum(finding.level is level for finding in shown) for level in Level}
    verdict = (
        f"{counts[Level.FINE]} fine, {counts[Level.NOTE]} to look at, {counts[Level.WRONG]} wrong"
    )
    console.print(
        f"{name}: {verdict}",
        style=COLOURS[Level.WRONG if counts[Level.WRONG] else Level.FINE],
        markup=False,
    )
    return shown


def _stops(
    console: Console, profile: RobotProfile, folder: Path, host: str | None, port: int | None
) -> bool:
    """Try what stops the robot, and offer to write it down; return whether all of it worked."""
    robot = profile.robot
    if isinstance(robot, ConfigError):
        raise robot
    # What was left out to read the rest may be what keeps somebody safe.
    if profile.faults:
        raise ConfigError("\n".join(profile.faults))
    if not robot.lead:
        raise ConfigError("robot.yaml: lead is false: nothing is ever written to the robot")
    config = load_twin_controller(robot, folder)
    layout = load_modbus_map(folder)
    address = (host or config.real.host, port or config.real.port)
    patience = max(config.real.timeout_ms * 1e-3, PATIENCE_S)
    # Only what is needed to read anything: all else is tried.
    needed = connections_needed(leads=True)
    gaps = has_slots(layout) and list(
        check_set_up(layout, probe_set_up(layout, *address, patience, needed), led=False)
    )
    if gaps and not is_healthy(gaps):
        show(console, profile, [gap for gap in gaps if gap.level is Level.WRONG], folder)
        return False
    console.print(STOPS_BEGIN.format(*address), markup=False)
    findings = []
    with StopTrials(robot, layout, config, address, answer) as trials:
        for finding in trials.run():
            # Told at once: who stands at the robot has to know it before the next question.
            findings.append(finding)
            tell(console, finding)
    # Behind the connection: how long the answer takes is no matter to the robot.
    _write_stops(console, robot, folder, address[0], trials)
    return is_healthy(findings)


def _write_stops(
    console: Console, robot: Robot, folder: Path, host: str, trials: StopTrials
) -> None:
    """Show what robot.yaml should say, and write it once somebody agrees."""
    path = locate("robot.yaml", folder)
    # Else what was seen at another address would be lost for nothing.
    if all(each.outcome is TrialEnd.LEFT_OUT for each in trials.results):
        console.print(f"{path} stays as it is: nothing was tried", markup=False)
        return
    uop = allocation(trials.outputs, trials.results, robot.stopping.uop)
    found = proposal(robot.stopping, host, trials.results, uop)
    means = ", ".join(f"{name}: {place}" for name, place in found.tried.items())
    console.print(f"{path}, stopping:\n  uop: {found.uop}\n  tried: {{{means}}}", markup=False)
    console.print(f"  braking_delay_ms: {found.braking_delay_ms:g}", markup=False)
    if found == robot.stopping:
        console.print("it says so already", markup=False)
        return
    try:
        agreed = answer("Write this?")
    except UnexpectedError as why:
        console.print(f"nothing was written: {why}", markup=False)
        return
    if agreed:
        today = datetime.date.today().isoformat()
        write_values(path, changes(robot.stopping, host, found, today))
        console.print(f"written: {path}", markup=False)


def _links(
    profile: RobotProfile,
    folder: Path,
    host: str | None,
    port: int | None,
    twin_url: str | None,
    move: bool,
) -> Generator[Finding, None, None]:
    """Yield what the robot and the twin answer.

    Files that are not usable leave nothing to ask with.
    """
    try:
        if isinstance(profile.robot, ConfigError):
            return
        config = load_twin_controller(profile.robot, folder)
        # As it is: what is wrong with it was told with the registers.
        layout = load(locate("modbus_map.yaml", folder), ModbusMap)
    except ConfigError as error:
        yield wrong(Group.LINKS, str(error), "correct the file; the links are checked then")
        return
    address = (host or config.real.host, port or config.real.port)
    if next(problems(layout), None) is None:
        taught = NO_FRAMES
        with contextlib.suppress(ConfigError):  # told among the other files
            taught = find_frames(folder)
        yield from _robot(profile, layout, config, address, move, taught)
    url = twin_url or config.twin.url
    try:
        access = read_access(config.twin, url, os.environ)
    except ConfigError as error:
        yield wrong(Group.LINKS, str(error), "the twin's link is checked then")
        return
    yield from ask_twin(url, access)


def _robot(
    profile: RobotProfile,
    layout: ModbusMap,
    config: TwinControllerConfig,
    address: tuple[str, int],
    move: bool,
    taught: FrameTable = NO_FRAMES,
) -> Iterator[Finding]:
    """Yield what the robot answers, and where it goes."""
    if isinstance(profile.robot, ConfigError):
        return
    # Who cannot be stopped by what is known to work is not moved either.
    if move and (why := profile.robot.only_followed(address[0])):
        yield wrong(Group.LINKS, f"nothing is moved: {why}", "doctor --stops comes before --move")
        return
    real = config.real
    try:
        if has_slots(layout):
            led = not profile.robot.only_followed(address[0])
            patience = max(real.timeout_ms * 1e-3, PATIENCE_S)
            needed = connections_needed(profile.robot.lead)
            shown = probe_set_up(layout, *address, patience, needed)
            gaps = list(check_set_up(layout, shown, led, taught))
            yield from gaps
            if not is_healthy(gaps):
                return
        times = real.poll_period_ms * 1e-3, SECONDS, real.timeout_ms * 1e-3
        answers = ask(profile.robot, layout, *address, *times)
    except (LinkLostError, ConfigError) as error:
        advice = (
            "start it (the stand-in: `rosrun fanuc_emulator emulator`), check address, port, "
            "device_id and registers"
        )
        yield wrong(Group.LINKS, str(error), advice)
        return
    found = list(check_answers(profile.robot, layout, answers, config))
    yield from found
    if move and is_healthy(found):
        mover = Mover(profile.robot, layout, config, *address)
        try:
            with mover:
                yield from mover.nudge_all()
        except (LinkLostError, KeyboardInterrupt) as why:
            what = f"ended: {str(why) or 'interrupted'}"
            yield wrong(Group.LINKS, what, "nothing goes on by itself: ask again")
        if not mover.rests:
            held = "HOLD was taken away and stays away; RESET on the page gives it back"
            yield wrong(
                Group.LINKS,
                "THE ROBOT IS NOT SEEN TO STAND: press its emergency stop",
                held if mover.reached else "the stop may not have been sent",
            )
    elif not move:
        yield note(
            Group.LINKS,
            "nothing was moved",
            "--move sends each joint a hair away and back, swings it by 10 degrees or 20 mm, and "
            "says how late it is; keep clear of the robot",
        )


main = app.run
