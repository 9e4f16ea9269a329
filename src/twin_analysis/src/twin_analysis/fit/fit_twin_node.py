"""``rosrun twin_analysis fit_twin BAG``: fit the twin to the robot from one recorded run.

The recorded set points go through the twin's physics and loops in process, faster than real time;
gains, damping, friction, bandwidth and delay are searched on the first part of the recording and
judged on the rest. A YAML difference is proposed; only ``--write`` changes the files, unless the
rest is worse by it: exit code 1. No ROS master is needed.
"""

from __future__ import annotations

import difflib
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from scara_config import ConfigError, Robot, config_directory, load_robot, locate
from scara_config.profile import robot_folder
from scara_config.writer import changed_text, replace_file
from scara_control.kinematics.screws import ScrewModel, tool_positions
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import WRONG
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.world_io import World
from twin_controller.config import load_twin_controller
from twin_experiments.config import load_experiments
from twin_experiments.report.label.sentence import missing_sentence

from twin_analysis.fit.offline_twin_io import SNAPSHOT_STEPS, OfflineTwin
from twin_analysis.fit.recording_io import Recording, check_robot, read_recording
from twin_analysis.fit.search import FitResult, fit_twin
from twin_analysis.fit.twin_model import Choice, FloatArray, TwinModel, names_of, yaml_values

MOVED_BORDER_UNITS = 1.0
WORSE = 1

app = CommandLine("fit_twin", {ConfigError: WRONG, BagError: WRONG}, help=__doc__)


@app.command()
def fit(
    bag: Annotated[Path, typer.Argument(help="bag of a run in which the real robot leads")],
    config_dir: Annotated[
        Path | None,
        typer.Option(help="folder of the YAML files; default: the package scara_config"),
    ] = None,
    held_out: Annotated[
        float, typer.Option(min=0.1, max=0.9, help="share of the recording that is not fitted")
    ] = 0.4,
    simulations: Annotated[
        int, typer.Option(min=10, max=10_000, help="most simulations of the search")
    ] = 150,
    write: Annotated[
        bool, typer.Option("--write", help="write the proposal into the YAML files")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="print what was found as JSON, the rest to stderr")
    ] = False,
) -> None:
    """Fit the twin to the robot."""
    console = Console(stderr=as_json)
    folder = Path(config_dir or config_directory())
    robot = load_robot(folder)
    with open_bag(bag) as opened:
        check_robot(opened, robot.name)
        simulation = load_simulation(robot, folder)
        longest_gap = load_experiments(robot, folder).metrics.longest_gap_s
        names = [joint.name for joint in robot.twin_joints]
        recording = read_recording(opened, names, SNAPSHOT_STEPS * simulation.dt, longest_gap)
        # Only who has read it knows what is missing of it.
        if opened.missing:
            console.print(missing_sentence(opened.missing), markup=False, soft_wrap=True)
    start = load_model(robot, folder)
    choice = choose(robot, recording)
    found = search(robot, folder, recording, start, choice, held_out, simulations, console)
    show(console, robot, choice, start, found)
    values = yaml_values(found.model, choice, names)
    worse = found.after[1].rms_mm > found.before[1].rms_mm
    written = propose(console, folder, values, write and not worse)
    said = "nothing was written; --write does"
    if written:
        said = f"written: {', '.join(str(path) for path in written)}"
    if worse:
        said = "nothing was written: on the held-out part the proposal is worse than before"
    console.print(said, style="bold", markup=False, soft_wrap=True)
    if as_json:
        print(json.dumps(fitted(robot, choice, found)))
    raise typer.Exit(WORSE if write and worse else 0)


def load_model(robot: Robot, folder: Path) -> TwinModel:
    """Return the twin's numbers of a configuration folder."""
    simulation, names = load_simulation(robot, folder), [j.name for j in robot.twin_joints]
    with World(
        robot.description,
        names,
        robot.tool_frame,
        dt=simulation.dt,
        gravity=simulation.gravity_m_s2,
        dynamics=simulation.dynamics,
    ) as world:
        damping, friction = tuple(world.damping), tuple(world.friction)
    delay = load_twin_controller(robot, folder).real.sample_latency_ms * 1e-3
    bandwidth = simulation.tracking_bandwidth_rad_s
    return TwinModel(
        tuple(load_gains(robot, folder)),
        damping,
        friction,
        bandwidth,
        delay,
        simulation.feed_forward,
    )


def choose(robot: Robot, recording: Recording) -> Choice:
    """Return what can be fitted.

    These are the joints of the arm that moved, and the delay if ground truth shows it.
    """
    columns = [
        k
        for k, (joint, moved) in enumerate(zip(robot.twin_joints, recording.moved))
        # The table does not carry the tool, whose error alone is looked at.
        if joint.screw_axis is not None and moved / joint.scale > MOVED_BORDER_UNITS
    ]
    if not columns:
        raise BagError("no joint of the arm moved in this recording")
    return Choice(tuple(columns), recording.truth)


def search(
    robot: Robot,
    folder: Path,
    recording: Recording,
    start: TwinModel,
    choice: Choice,
    held_out: float,
    most: int,
    console: Console,
) -> FitResult:
    """Run the search under a progress bar."""
    names = [joint.name for joint in robot.twin_joints]
    arm, columns = (
        ScrewModel.from_robot(robot),
        [k for k, j in enumerate(robot.twin_joints) if j.screw_axis is not None],
    )
    twin = OfflineTwin(robot, load_simulation(robot, folder), robot.description)
    real = tool_positions(arm, recording.real[:, columns])
    # Stamps of a recording that does not tell were made, as far as anybody knows, by today's
    # number.
    recorded = start.delay if recording.delay is None else recording.delay

    def simulate(model: TwinModel) -> FloatArray:
        pose = [float(value) for value in recording.real[0]]
        # One snapshot more, so that the last instant lies between two.
        length = recording.duration + SNAPSHOT_STEPS * 1e-3
        times, joints = twin.run(model, recording.packets, recorded, pose, length)
        spread = np.stack(
            [np.interp(recording.times, times, joints[:, k]) for k in columns], axis=1
        )
        return tool_positions(arm, spread)

    bar = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    # In a file it would be one line with the time that it took: other words for the same fit.
    with Progress(*bar, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("fitting", total=most)

        def told(error: float) -> None:
            progress.update(task, advance=1, description=f"fitting, {error:.3f} mm rms")

        training = int(len(real) * (1.0 - held_out))
        found = fit_twin(start, choice, names, real, training, simulate, most, told)
        progress.update(task, completed=most)
    return found


def show(
    console: Console, robot: Robot, choice: Choice, start: TwinModel, found: FitResult
) -> None:
    """Print what was found and what it brings."""
    names = names_of(choice, [joint.name for joint in robot.twin_joints], start)
    table = Table(title=f"tool error, {found.evaluations} simulations")
    for column in ("", "before", "after", "better by"):
        table.add_column(column, justify="right" if column else "left")
    for k, part in enumerate(("fitted part", "held-out part")):
        for what in ("rms_mm", "max_mm"):
            before, after = getattr(found.before[k], what), getattr(found.after[k], what)
            table.add_row(
                f"{part}, {what[:3]}",
                f"{before:.3f} mm",
                f"{after:.3f} mm",
                f"{before / max(after, 1e-9):.1f} x",
            )
    console.print(table)
    for name, value in zip(names, found.vector):
        text = f"{20.0 * value:+.3f} ms" if name == "delay" else f"x {np.exp(value):.3f}"
        console.print(f"  {name:<22}{text}", highlight=False)


def fitted(robot: Robot, choice: Choice, found: FitResult) -> dict[str, Any]:
    """Return what a program reads of a fit: friction of the joints that moved, errors, delay."""
    joints = {k: robot.twin_joints[k] for k in choice.columns}
    units = {"m": "N", "rad": "N m"}
    return {
        "friction": {joint.name: found.model.friction[k] for k, joint in joints.items()},
        "units": {joint.name: units[joint.si_unit] for joint in joints.values()},
        "rms_mm": [found.before[1].rms_mm, found.after[1].rms_mm],
        "delay_ms": 1e3 * found.model.delay if choice.delay else None,
    }


def propose(
    console: Console, folder: Path, values: dict[str, dict[tuple[str, ...], float]], write: bool
) -> list[Path]:
    """Show the YAML difference, and write it if asked to; return the files that were written.

    They are the robot's own: one that it shared is copied there as a whole.
    """
    places = {name: locate(name, folder) for name in values}
    texts = {name: changed_text(places[name], changes) for name, changes in values.items()}
    for name, text in texts.items():
        before = places[name].read_text(encoding="utf-8")
        lines = difflib.unified_diff(
            before.splitlines(), text.splitlines(), name, f"{name} (proposed)", lineterm="", n=0
        )
        console.print("\n".join(lines), markup=False, highlight=False, soft_wrap=True)
    if not write:
        return []
    own = {robot_folder(folder) / name: text for name, text in texts.items()}
    for path, text in own.items():
        replace_file(path, text)
    return list(own)


main = app.run
