"""Try a motion before steel moves: rosrun what_if judge PROGRAM|x,y,z[,yaw]|BAG.

It begins where the arm of the running cell stands, or at home with parts on their stands
(``--resting``, or if no cell runs). Nothing is written to any wire. Exit code 0 OK, 1 LIMITED,
2 REFUSED, 3 it could not be judged.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from scara_config import ConfigError
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot

from what_if.cell_files_io import find_program, resting_cell
from what_if.errors import WhatIfError
from what_if.judging import judge as judged
from what_if.learning.recorded_way_io import read_way
from what_if.motions import Motion, point_of
from what_if.physics import Simulated, physics_lines
from what_if.showing.moment import worst_moment
from what_if.text import caption_of, lines_of
from what_if.uncertainty.chances import Chances, chances_lines
from what_if.verdict import Outcome, Verdict
from what_if.world import World

CODES = {Outcome.OK: 0, Outcome.LIMITED: 1, Outcome.REFUSED: 2}
FAILED = 3
NICENESS = 10
"""As the judge beside a cell; our choice."""
app = CommandLine(
    "judge",
    {ConfigError: FAILED, WhatIfError: FAILED},
    help="Try a motion before steel moves.",
    rich_markup_mode=None,
    # A point with a negative x begins as an option does: -0.5,0.1,0.1.
    context_settings={"ignore_unknown_options": True},
)


@app.command()
def judge(
    motion: Annotated[
        str,
        typer.Argument(
            help="A program's name or file; a point x,y,z[,yaw] in m and deg; a bag.",
            metavar="PROGRAM|x,y,z[,yaw]|BAG",
        ),
    ],
    speed: Annotated[
        float, typer.Option(help="Of a move to a point [%]; default: motion.yaml.", max=100.0)
    ] = 0.0,
    elbow: Annotated[str, typer.Option(help="Of a move to a point: righty or lefty.")] = "",
    resting: Annotated[
        bool, typer.Option("--resting", help="Begin at home, whatever cell runs.")
    ] = False,
    physics: Annotated[
        bool, typer.Option("--physics", help="Then make it in the simulated world, too.")
    ] = False,
    worlds: Annotated[
        int,
        typer.Option(help="Then try it in so many worlds that differ by what is not known.", min=0),
    ] = 0,
    seed: Annotated[int, typer.Option(help="Of these worlds.")] = 0,
    workers: Annotated[
        int, typer.Option(help="Processes for them; default: one for each processor.", min=0)
    ] = 0,
    picture: Annotated[
        Path | None, typer.Option(help="Write a picture of the worst moment there, as PNG.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the verdict as JSON.")] = False,
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Try a motion before steel moves."""
    choose_robot(robot)
    drawing = (worlds, seed, workers)
    # Beside a running cell nothing shall wait for it.
    os.nice(NICENESS)
    with _world(config_dir, resting) as world:
        begun, asked = _asked(world, motion, speed, elbow, config_dir)
        verdict = judged(begun, asked)
        made: Simulated | None = None
        # What geometry refuses is not tried.
        if physics and verdict.outcome is not Outcome.REFUSED:
            from what_if.second_world_io import SecondWorld

            with SecondWorld(begun, config_dir) as second:
                made = second.run(begun, asked)
        found = _chances(begun, asked, drawing, config_dir) if worlds else None
        drawn = _drawn(begun, asked, verdict, picture, config_dir) if picture else []
    if as_json:
        told = msgspec.to_builtins(verdict) | ({"physics": made} if made else {})
        told |= {"chances": found} if found else {}
        typer.echo(msgspec.json.format(msgspec.json.encode(told), indent=1).decode())
    else:
        beside = [*(physics_lines(made) if made else []), *(chances_lines(found) if found else [])]
        typer.echo("\n".join([*lines_of(verdict), *drawn, *beside]))
    worst = max(CODES[verdict.outcome], CODES[made.outcome] if made else 0)
    raise typer.Exit(worst)


def _drawn(
    world: World, motion: Motion, verdict: Verdict, file: Path, config_dir: Path | None
) -> list[str]:
    """Write a picture of the worst moment; return what is said of it.

    Raises:
        ConfigError: camera.yaml is wrong.
        WhatIfError: The file cannot be written.
    """
    from what_if.showing.moment_picture_io import picture_of

    moment = worst_moment(world, motion, verdict)
    if moment is None:
        return ["picture    none: there is no way to show"]
    try:
        file.write_bytes(picture_of(moment, caption_of(verdict), config_dir))
    except OSError as error:
        raise WhatIfError(f"{file}: cannot be written: {error.strerror}") from error
    return [f"picture    {file}, the moment at {moment.time:.2f} s"]


def _chances(
    world: World, motion: Motion, drawing: tuple[int, int, int], config_dir: Path | None
) -> Chances:
    """Try a motion in drawn worlds, with progress on standard error.

    Raises:
        WhatIfError: Their processes were killed.
    """
    from rich.console import Console
    from rich.progress import Progress

    from what_if.uncertainty.many_worlds_io import chances

    worlds, seed, workers = drawing
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("worlds", total=worlds)
        return chances(
            world,
            motion,
            worlds,
            seed,
            workers,
            config_dir,
            lambda done: progress.update(bar, completed=done),
        )


def _asked(
    world: World, text: str, speed: float, elbow: str, config_dir: Path | None
) -> tuple[World, Motion]:
    """Return what the argument means, and the world in which it begins.

    Raises:
        ConfigError: There is no such program.
        WhatIfError: The point or the bag is wrong.
    """
    point = point_of(text, speed, elbow)
    if point is not None:
        return world, point
    if text.endswith(".bag"):
        recorded = read_way(world.cell, Path(text))
        return replace(world, q=recorded.way.points[0].q), recorded
    return world, find_program(world.cell, text, config_dir)


@contextmanager
def _world(config_dir: Path | None, resting: bool) -> Iterator[World]:
    """Yield the live cell's world, or one at rest where no cell runs."""
    with resting_cell(config_dir) as (world, models):
        if resting:
            yield world
            return
        from what_if.live_world_node import live_world

        live = live_world(world, models)
        if live is None:
            typer.echo("judge: no cell answers: from home, parts on their stands", err=True)
        yield live or world


main = app.run
