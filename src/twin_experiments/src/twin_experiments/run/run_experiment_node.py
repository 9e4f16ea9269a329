"""Command ``run_experiment``.

Runs the article's experiments on a running cell, records them, reports.

    rosrun twin_experiments run_experiment real_leads twin_leads --output DIR --speed PERCENT
    rosrun twin_experiments run_experiment palletise --repeat N

Parameter: ``_config_dir:=FOLDER`` (experiments.yaml, robot.yaml). Calls ``recorder/start``,
``recorder/stop``, ``move_to`` and ``twin_controller/command``; publishes ``experiment/marker``;
starts programs by the pendant. Exit code: 0 all passed, 1 a verdict failed, 2 wrong configuration
or arguments, 3 the run could not be made, 130 interrupted.
"""

from __future__ import annotations

import signal
import sys
import time
from datetime import datetime
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from cell_recorder.reading.bag_reader_io import BagError
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn
from scara_config import ConfigError, Robot, load_robot
from scara_config.palletise import Palletise, find_palletise
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import (
    FAILED,
    INTERRUPTED,
    WRONG,
    link_latest,
    new_run_folder,
    private_parameters,
    runs_folder,
)

from twin_experiments.config import (
    Experiment,
    ExperimentsFile,
    RealLeads,
    RealPalletises,
    TwinLeads,
    TwinPalletises,
    load_experiments,
)
from twin_experiments.report.record import RecordError
from twin_experiments.run.cell_node import RunError, RunningCell, enter_ros
from twin_experiments.run.palletiser_node import Palletiser
from twin_experiments.run.pendant_io import PendantCallError, PendantCalls
from twin_experiments.run.terminal_node import print_report

BAG_NAME = "run.bag"
TAIL_S = (
    0.3  # our choice: recorded after the last marker, so that both sides have samples beyond it
)
NOT_RUN = 3

app = CommandLine(
    "run_experiment",
    {
        ConfigError: WRONG,
        RunError: NOT_RUN,
        PendantCallError: NOT_RUN,
        BagError: NOT_RUN,
        RecordError: NOT_RUN,
        OSError: NOT_RUN,
        KeyboardInterrupt: INTERRUPTED,
    },
    help="Run experiments on a running cell, record them and report.",
)
console = Console(highlight=False)


class Runner:
    """Runs experiments on a cell, one after the other."""

    def __init__(
        self,
        cell: RunningCell,
        robot: Robot,
        config: ExperimentsFile,
        pendant: PendantCalls,
        progress: Progress,
        work: Palletise | None,
    ) -> None:
        """Take what an experiment needs; ``work`` is that of the parts."""
        self._cell, self._work = cell, work
        self._positions = robot.positions_m
        self._config = config
        self._pendant = pendant
        self._progress = progress
        # So long that it counts as a rest even without what is cut off at its end.
        self._rest = config.metrics.rest_s + 2.0 * config.metrics.rest_margin_s

    def run(self, name: str, experiment: Experiment) -> None:
        """Run one experiment between its markers, starting with both sides at rest."""
        task = self._progress.add_task(f"{name}: getting ready", total=self._steps(experiment))
        self._cell.wait_ready(
            lambda text: self._progress.update(task, description=f"{name}: {text}")
        )
        if isinstance(experiment, RealPalletises | TwinPalletises):
            self._cell.put_parts_back()
        if isinstance(experiment, TwinLeads):
            self._progress.update(task, description=f"{name}: to {experiment.visits[0]}")
            self._cell.move_to(self._positions[experiment.visits[0]], experiment.speed_percent)
            self._cell.wait_still(self._rest)
        self._cell.mark(f"start {name}")
        if isinstance(experiment, TwinLeads):
            for number, visit in enumerate(experiment.visits):
                self._progress.update(task, description=f"{name}: {visit}", completed=number)
                self._cell.move_to(self._positions[visit], experiment.speed_percent)
                self._cell.wait_still(max(experiment.dwell_s, self._rest))
        elif isinstance(experiment, TwinPalletises):
            self._twin_palletises(name, task)
        else:
            self._real_leads(name, experiment, task)
        self._cell.mark(f"end {name}")
        self._progress.update(task, description=name, completed=self._steps(experiment))

    def _steps(self, experiment: Experiment) -> int:
        """Return how many steps an experiment has, for the progress bar."""
        moves = 0
        if self._work and not isinstance(experiment, RealLeads | TwinLeads):
            moves = len(self._work.starts())
        return moves or len(experiment.visits)

    def _twin_palletises(self, name: str, task: TaskID) -> None:
        """Let the twin carry all parts."""
        assert self._work is not None

        def tell(done: int, part: str) -> None:
            self._progress.update(task, description=f"{name}: {part}", completed=done)

        Palletiser(self._cell, self._work, self._config.deadlines_s.service).run(tell)
        self._cell.wait_still(self._rest)

    def _real_leads(self, name: str, experiment: RealLeads | RealPalletises, task: TaskID) -> None:
        """Start the program on the robot's own pendant and wait for its end."""
        # The pendant takes whole percents.
        self._pendant("override", str(round(experiment.override_percent)))
        self._pendant("run", experiment.program)
        before, deadlines = self._cell.moves("real"), self._config.deadlines_s
        self._cell.wait_until(
            lambda: self._cell.running, deadlines.service, f"program {experiment.program} to run"
        )

        def ended() -> bool:
            begun = self._cell.moves("real") - before
            self._progress.update(
                task,
                description=f"{name}: {experiment.program}",
                # A program may make more moves than it has positions.
                completed=min(begun, self._steps(experiment)),
            )
            return not self._cell.running

        self._cell.wait_until(ended, deadlines.program, f"program {experiment.program} to end")
        self._cell.wait_still(self._rest)


@app.command()
def run_experiment(
    names: Annotated[
        list[str] | None, typer.Argument(help="Of experiments.yaml; default: the article's two.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(help="Folder of bag and report; default: runs/<stamp>, linked as latest."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(help="Override of the robot and speed of move_to.", min=1, max=100),
    ] = None,
    repeat: Annotated[
        int, typer.Option(help="How often each experiment is made.", min=1, max=1000)
    ] = 1,
    robot_host: Annotated[
        str | None, typer.Option(help="For the pendant; default: emulator.yaml.")
    ] = None,
    robot_port: Annotated[
        int | None, typer.Option(help="For the pendant; default: emulator.yaml.")
    ] = None,
) -> None:
    """Run experiments on a running cell, record them and report."""
    for number in (
        signal.SIGINT,
        signal.SIGTERM,
    ):  # SIGINT too: a shell's background job is started with it ignored
        signal.signal(number, signal.default_int_handler)
    folder = private_parameters(sys.argv).get("config_dir")
    robot = load_robot(folder)
    config = load_experiments(robot, folder)
    chosen = {
        name: _at_speed(experiment, speed)
        for name, experiment in config.select(names or []).items()
    }
    work = find_palletise(folder)
    if work is None and any(name in config.palletising for name in chosen):
        raise ConfigError(f"{robot.name} has no palletise.yaml: it has no parts")
    wait = config.deadlines_s.cell
    enter_ros("run_experiment", wait, lambda text: console.print(text, soft_wrap=True))
    cell = RunningCell(robot, config.metrics.moving_speed_percent, config.deadlines_s)
    options = {"--host": robot_host, "--port": robot_port, "--config-dir": folder}
    words = [
        word for name, value in options.items() if value is not None for word in (name, str(value))
    ]
    run_folder = _run_folder(output)
    bag = run_folder / BAG_NAME
    _record(
        cell,
        robot,
        config,
        PendantCalls(words, config.deadlines_s.service),
        chosen,
        repeat,
        bag,
        work,
    )
    from twin_experiments.report.report_io import write_report  # figures: a run begins without them

    report = write_report(bag, run_folder, Path(folder) if folder else None)
    if output is None:
        link_latest(run_folder)
    print_report(report, console)
    raise typer.Exit(0 if report.passed else FAILED)


def _record(
    cell: RunningCell,
    robot: Robot,
    config: ExperimentsFile,
    pendant: PendantCalls,
    chosen: dict[str, Experiment],
    repeat: int,
    bag: Path,
    work: Palletise | None,
) -> None:
    """Run the experiments, each ``repeat`` times, into one bag.

    Whatever ends them, motion and recording are stopped.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    with console.status("looking for the cell") as status:
        cell.wait_ready(lambda text: status.update(text))
    if any(isinstance(experiment, RealLeads | RealPalletises) for experiment in chosen.values()):
        # Before anything is recorded or moves: a pendant that finds no robot ends the run here.
        pendant("status")
    cell.start_recording(bag)
    try:
        with Progress(*columns, console=console) as progress:
            runner = Runner(cell, robot, config, pendant, progress, work)
            for _ in range(repeat):
                for name, experiment in chosen.items():
                    runner.run(name, experiment)
        time.sleep(TAIL_S)
    # After an interrupt too: whatever ends a run must not leave the robot moving.
    except BaseException:
        trouble = cell.stop_motion()
        console.print("stopping the motion" + (f": {trouble}" if trouble else ""))
        try:
            cell.stop_recording()
        except RunError as error:
            console.print(str(error))
        console.print(f"what was recorded is in {bag}", soft_wrap=True)
        raise
    console.print(f"{cell.stop_recording()} messages in {bag}", soft_wrap=True)


def _at_speed(experiment: Experiment, speed: float | None) -> Experiment:
    """Return the experiment with another speed, if one is given."""
    if speed is None:
        return experiment
    if isinstance(experiment, TwinPalletises):
        raise ConfigError("--speed: the twin palletises at the speeds of palletise.yaml")
    real = isinstance(experiment, RealLeads | RealPalletises)
    field = "override_percent" if real else "speed_percent"
    return msgspec.structs.replace(experiment, **{field: speed})


def _run_folder(output: Path | None) -> Path:
    """Return the folder of this run; an older bag in it is never overwritten.

    Raises:
        RunError: There is a bag already.
    """
    if output is None:
        return new_run_folder(runs_folder(), datetime.now().strftime("%Y-%m-%d_%H-%M-%S"))
    if (output / BAG_NAME).exists():
        raise RunError(f"{output / BAG_NAME} exists already: choose another folder")
    output.mkdir(parents=True, exist_ok=True)
    return output.resolve()


main = app.run
