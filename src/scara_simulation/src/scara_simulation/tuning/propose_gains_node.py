"""Propose PID gains for a robot from the inertia of its URDF; no ROS master needed.

rosrun scara_simulation propose_gains --robot NAME [--write]: prints what pid_gains.yaml should
hold; ``--write`` writes it, unless there is one (``--overwrite``). Exit code 0, or 2 when a file
cannot be used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from scara_config import ConfigError, Robot, load_robot
from scara_config.profile import robot_folder
from scara_config.writer import replace_file
from scara_ros.shell.command_line_io import CommandLine, RobotName, choose_robot
from scara_ros.shell.program_io import WRONG

from scara_simulation.config import LoopGains, load_simulation
from scara_simulation.tuning.proposal import propose
from scara_simulation.tuning.stability import sample_plant
from scara_simulation.world_io import World

HEAD = """\
# The twin's PID loops: control_toolbox's gain names, error = set point - measured, output = effort
# [N m] or [N].
# Our choice: proposed by `rosrun scara_simulation propose_gains --robot {name}` from the largest
# inertia J in the URDF, w in brackets:
#   position  p = J w^2, d = 2 J w, i = p w / 6;  velocity  p = J w, i = J w^2 / 80;  i_clamp 1.5
# times the dry friction
# Changed while the simulator runs by twin/pid/<joint> (docs/tuning.md), which keeps these comments.
"""
app = CommandLine(
    "propose_gains",
    {ConfigError: WRONG},
    help="Propose PID gains from the URDF.",
    rich_markup_mode=None,
)


@app.command()
def propose_gains(
    robot: RobotName = None,
    write: Annotated[bool, typer.Option("--write", help="Write pid_gains.yaml.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Even if there is one.")] = False,
) -> None:
    """Propose PID gains from the URDF."""
    console = Console(highlight=False, soft_wrap=True)
    choose_robot(robot)
    text = gains_text(load_robot())
    console.print(text, markup=False)
    file = robot_folder() / "pid_gains.yaml"
    if (write and not file.exists()) or overwrite:
        replace_file(file, text)
        console.print(f"{file}: written", markup=False)
    elif write:
        console.print(f"{file}: exists; --overwrite replaces it", markup=False)


def gains_text(robot: Robot, directory: Path | None = None) -> str:
    """Return what pid_gains.yaml should hold.

    Args:
        robot: The profile; its URDF is sampled over the workspace.
        directory: With simulation.yaml; default: the package scara_config.

    Raises:
        ConfigError: A file is missing or wrong.
    """
    config, joints = load_simulation(robot, directory), robot.twin_joints
    with World(
        robot.description,
        [joint.name for joint in joints],
        robot.tool_frame,
        dt=config.dt,
        gravity=config.gravity_m_s2,
    ) as world:
        limits = [(joint.lower, joint.upper) for joint in joints]
        plant = sample_plant(
            world.mass_matrix, limits, world.damping, config.dt, config.tracking_bandwidth_rad_s
        )
        proposals = propose(plant.mass_matrices, list(world.friction), config.dt)
    entries = (_lines(joint.name, *proposal) for joint, proposal in zip(joints, proposals))
    return HEAD.format(name=robot.name) + "".join(entries)


def _lines(name: str, bandwidth: float, loops: LoopGains) -> str:
    """Return the entry of one joint."""
    rows = []
    for kind in ("position", "velocity"):
        gains = getattr(loops, kind)
        values = (
            f"p: {gains.p}, i: {gains.i}, d: {gains.d}, i_clamp: {gains.i_clamp}, antiwindup: true"
        )
        rows.append(f"  {kind}: {{{values}}}\n")
    return f"{name}:  # [{bandwidth:g} rad/s]\n" + "".join(rows)


main = app.run
