"""Command ``replay_to_twin``.

The recorded real side drives a live twin as if it were there, and the same errors are reported.

    rosrun scara_bringup cell up --without emulator          # in another shell, before or after
    rosrun twin_analysis replay_to_twin BAG --rate 2 --output DIR

Parameter: ``_config_dir:=FOLDER``. Serves the recorded readings over Modbus where the live twin
controller looks for its robot, so that its whole way is used: polling, clocks, onset, alignment,
following. The robot that is played obeys no set point and no stop: it does what it did. Exit code:
0 played and compared, 1 the live controller stopped the pair, or something could not be compared, 2
wrong configuration, 3 it could not be played, 130 interrupted.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.reading.bag_reader_io import BagError
from fanuc_emulator.config import load_emulator
from fanuc_emulator.modbus.modbus_server_io import PortError
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from scara_config import ConfigError, Robot, load_robot
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import INTERRUPTED, WRONG, private_parameters
from twin_controller.config import load_twin_controller
from twin_controller.reporting.snapshots import SnapshotError
from twin_experiments.metrics.series import Motion, SampleGap, find_gaps, known_at
from twin_experiments.metrics.tracks import Track
from twin_experiments.report.record import RecordError, cut
from twin_experiments.report.run_reader_io import TWIN
from twin_experiments.run.cell_node import RunError, enter_ros

from twin_analysis.compare.compare_node import print_comparison
from twin_analysis.compare.config import load_comparison
from twin_analysis.compare.track_reader_io import (
    Topics,
    find_mechanism,
    kind_of,
    read_bag,
    tracks_of,
)
from twin_analysis.compare.writer_io import (
    WrittenComparison,
    compare_tracks,
    comparer_of,
    remarks_of,
    write_files,
)
from twin_analysis.replay.live_twin_node import LiveTwin
from twin_analysis.replay.playback import Playback, plan_playback
from twin_analysis.replay.reader_io import read_real
from twin_analysis.replay.stage_io import Stage, StageError

INCOMPLETE, NOT_PLAYED = 1, 3
READY_S = 90.0  # our choice: as scara_bringup's ready_timeout
TAIL_S = 1.0  # our choice: after the last row, until the follower has arrived
RECORDED, LIVE = "recorded", "live"

app = CommandLine(
    "replay_to_twin",
    {
        ConfigError: WRONG,
        RunError: NOT_PLAYED,
        BagError: NOT_PLAYED,
        RecordError: NOT_PLAYED,
        SnapshotError: NOT_PLAYED,
        StageError: NOT_PLAYED,
        OSError: NOT_PLAYED,
        KeyboardInterrupt: INTERRUPTED,
    },
    help="Let the recorded real robot drive a live twin.",
)
console = Console(highlight=False)


@app.command()
def replay_to_twin(
    bag: Annotated[Path, typer.Argument(help="Recording of a run, unfinished ones too.")],
    rate: Annotated[
        float,
        typer.Option(
            help="How much faster than recorded, where the joints can.", min=0.05, max=20.0
        ),
    ] = 1.0,
    output: Annotated[
        Path | None,
        typer.Option(help="Folder of table and figures; default: replay beside the bag."),
    ] = None,
    real_topic: Annotated[
        str | None,
        typer.Option(help="Joint states to be played; default: the controller's readings."),
    ] = None,
    host: Annotated[
        str | None, typer.Option(help="Where to serve; default: twin_controller.yaml.")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="Where to serve; default: twin_controller.yaml.")
    ] = None,
) -> None:
    """Let the recorded real robot drive a live twin, and report the same errors."""
    # As Ctrl-C, so that contexts are left and the port is free again.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    folder = private_parameters(sys.argv).get("config_dir")
    try:
        written, stops = _run(
            bag, rate, (output or bag.parent / "replay").resolve(), real_topic, (host, port), folder
        )
    except PortError as error:
        raise RunError(f"{error}; start the cell with --without emulator") from error
    print_comparison(written, console)
    raise typer.Exit(
        INCOMPLETE if stops or any(experiment.reasons for experiment in written.experiments) else 0
    )


def _run(
    bag: Path,
    rate: float,
    output: Path,
    topic: str | None,
    address: tuple[str | None, int | None],
    folder: str | None,
) -> tuple[WrittenComparison, list[str]]:
    """Read, play, compare.

    Return what was written, and when the live controller stopped the pair.
    """
    directory = Path(folder) if folder else None
    robot = load_robot(directory)
    place = load_twin_controller(robot, directory).real
    opened = read_bag(bag, RECORDED, Topics(topic), directory)
    mechanism = find_mechanism([opened])
    if mechanism.names != tuple(joint.name for joint in robot.twin_joints):
        raise RecordError(
            f"{bag}: has {', '.join(mechanism.names)}; the twin needs "
            f"{[j.name for j in robot.twin_joints]}"
        )
    kinds = [kind_of(each, mechanism.names) for each in (opened.robot, robot)]
    if kinds[0] != kinds[1]:
        raise RecordError(f"{bag}: was recorded of {kinds[0]}; the twin is one of {kinds[1]}")
    recorded, ran, source = read_real(bag, mechanism, topic)
    playback = plan_playback(robot, recorded, ran, rate, load_emulator(robot, directory).dt)
    enter_ros("replay_to_twin", READY_S, lambda text: console.print(text, soft_wrap=True))
    with Stage(
        robot, playback, address[0] or place.host, address[1] or place.port, folder
    ) as stage:
        twin = LiveTwin(mechanism.names)
        motion = _play(stage, playback, twin)
        begun = stage.begun
    holes = find_gaps(recorded, opened.experiments.metrics.longest_gap_s)
    live = _live(robot, playback, motion.shifted(-begun), place.sample_latency_ms * 1e-3, holes)
    remarks = (
        *remarks_of([opened]),
        f"{LIVE}: real is what was played of {source}, in {playback.duration:.1f} s, dated "
        f"{place.sample_latency_ms:g} ms earlier, as the controller does; twin is {TWIN}",
        *(f"{LIVE}: {stop}" for stop in twin.stops),
    )
    # Hold the live pair beside the recorded one, experiment by experiment, and write it
    comparer, percent = comparer_of(opened, mechanism, load_comparison(directory))
    tracks, lost = tracks_of(opened, mechanism, percent)
    compared = [compare_tracks(name, [], comparer, [text]) for name, text in lost]
    for track in tracks:
        # The live pair does what was recorded, be it a part: no more of the experiment is to come.
        sides = [replace(track, finished=True), live(track)]
        beside = compare_tracks(track.experiment, sides, comparer)
        # At another pace the same time after the start is another place: run against run says
        # nothing.
        compared.append(beside if rate == 1.0 else replace(beside, runs=()))
    written = WrittenComparison(
        mechanism, tuple(compared), {RECORDED: "the bag", LIVE: "now"}, remarks, output
    )
    write_files(written)
    return written, twin.stops


def _play(stage: Stage, playback: Playback, live: LiveTwin) -> Motion:
    """Wait for the twin, play, and return what it did, in ROS time."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=1.0)

        def tell(text: str) -> None:
            progress.update(task, description=text)

        live.wait_idle(READY_S, tell, stage.check)
        live.record()
        stage.play()
        progress.update(task, description=f"playing {playback.duration:.1f} s")

        def ended() -> bool:
            progress.update(task, completed=stage.part)
            return stage.ended

        live.wait_played(ended, playback.duration + READY_S, lambda text: None)
        time.sleep(TAIL_S)
    return live.recorded()


def _live(
    robot: Robot,
    playback: Playback,
    twin: Motion,
    latency: float,
    holes: Sequence[SampleGap] = (),
) -> Callable[[Track], Track]:
    """Return what makes the live track that belongs to a recorded one.

    Times count from when the first row was shown. A row is true ``latency`` [s] before it is shown:
    the controller dates the robot's readings so, and leads the twin accordingly. What is played
    through the ``holes`` of the recording is nobody's motion, and is held against nothing.
    """
    columns = [k for k, joint in enumerate(robot.joints) if joint.twin]
    played = playback.motion(-latency, columns)
    known = known_at(playback.instants, holes)
    kept = played.stamps[known], played.positions[known], played.velocities[known]
    real = Motion("real", *kept)

    def track_of(recorded: Track) -> Track:
        start, end = (
            playback.played_at(float(at)) - latency for at in recorded.real.stamps[[0, -1]]
        )
        sides = [cut(motion, start, end) for motion in (real, twin)]
        return Track(LIVE, recorded.experiment, "real", sides[0], sides[1], start=start, end=end)

    return track_of


main = app.run
