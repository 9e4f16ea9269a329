"""The twin's simulator, as its node puts it together, without a clock of its own."""

from __future__ import annotations

from collections.abc import Sequence

from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.simulation import Simulation, Timing
from scara_simulation.world_io import World

from harness.virtual_cell.files import CellFiles


def open_world(files: CellFiles) -> World:
    """Load the cell into PyBullet; the caller closes it."""
    config = files.simulation
    return World(
        files.robot.description,
        [joint.name for joint in files.robot.twin_joints],
        files.robot.tool_frame,
        dt=config.dt,
        gravity=config.gravity_m_s2,
        dynamics=config.dynamics,
    )


def build_simulation(
    world: World, files: CellFiles, epoch_ns: int, *, compiled: bool = True
) -> Simulation:
    """Put world, control and the nominal time axis together, at the home pose.

    ``compiled``: the joints' loops in C, where they were built.
    """
    robot, config = files.robot, files.simulation
    factor = config.model_mass_factor

    def model(q: list[float], qdot: list[float], qddot: list[float]) -> Sequence[float]:
        efforts = world.inverse_dynamics(q, qdot, qddot)
        return efforts if factor == 1.0 else [factor * effort for effort in efforts]

    control = JointControl(
        joint_models(robot, config, world.damping, world.friction),
        files.gains,
        robot.home_positions,
        config.dt,
        model if config.feed_forward else None,
        config.tracking_bandwidth_rad_s,
        compiled=compiled,
    )
    timing = Timing(
        config.step_ns,
        epoch_ns,
        config.physics_rate_hz // config.joint_states_rate_hz,
        config.physics_rate_hz,
    )
    return Simulation(world, control, robot.home_positions, timing)
