"""Node ``simulator``: the twin's physics and its PID loops, in Gazebo's place.

Parameters: ``~config_dir`` (default: package scara_config), ``~real_time_factor`` (1.0; 0: as fast
as possible; other than 1 needs ``~publish_clock``), ``~publish_clock`` (false).
Topics out: ``twin/joint_states``, ``twin/<joint>_position_controller/state``,
``twin/<joint>_velocity_controller/state`` (of the loop that is closed; as ``.../state_each_step``
for each physics step while somebody listens), ``twin/controller_modes``, ``/diagnostics``,
``/clock`` on request, ``twin/pid/status``, ``twin/pid/<joint>/parameter_descriptions``,
``twin/pid/<joint>/parameter_updates`` (see tuning_ports); what
the tool carries: see payload_ports; ``twin/parts``, ``twin/gripper``,
``twin/part_events`` and the service ``gripper`` if there is work (palletise.yaml): see parts_ports.
Topics in: ``twin/joint_setpoints``, ``twin/<joint>_position_controller/command``,
``twin/<joint>_velocity_controller/command`` (ends if nobody repeats it), ``motion_command``,
``joint_pose_controller/speed_limit_percent`` (the cap of all motion).
Services: ``pause_physics``, ``unpause_physics``, ``reset_simulation``, ``step``;
``twin/pid/<joint>/set_parameters``, ``twin/pid/undo`` (see tuning_ports).
Exit codes: 0 after a signal, 1 when the simulation died, 2 when it cannot start.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import rospy
from scara_config import ConfigError, Robot, load_robot
from scara_config.frames import FrameTable, find_frames
from scara_config.palletise import Palletise, find_palletise
from scara_config.payload import Payload, load_payloads
from scara_control.config import load_motion
from scara_ros.process.memory_io import keep_for_good
from scara_ros.process.scheduling_io import go_first
from scara_ros.shell.ros_node import own_frame, starting
from scara_ros.starting.starting_node import until_shutdown

from scara_simulation.command_desk import CommandDesk
from scara_simulation.commands import CommandGate
from scara_simulation.config import (
    LoopGains,
    SimulationConfig,
    gains_path,
    load_gains,
    load_simulation,
)
from scara_simulation.handling.part_world_io import PartWorld
from scara_simulation.handling.parts_ports_node import PartsPorts
from scara_simulation.handling.payload_desk import PayloadDesk, part_payload
from scara_simulation.handling.payload_ports_node import PayloadPorts
from scara_simulation.handling.told_dynamics_io import ToldDynamics
from scara_simulation.joints.cells import step_efforts
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.real_time_runner_io import RealTimeRunner
from scara_simulation.simulation import Simulation, Snapshot, Timing
from scara_simulation.simulator_diagnostics_node import DiagnosticsPort
from scara_simulation.simulator_ports_node import CommandPorts, StatePorts
from scara_simulation.tuning.gains import Tuning, TuningError
from scara_simulation.tuning.stability import sample_plant
from scara_simulation.tuning.tuning_ports_node import TuningPorts
from scara_simulation.world_io import World


def main() -> None:
    """Run the node."""
    with starting("simulator") as directory:
        robot = load_robot(directory)
        config, gains = load_simulation(robot, directory), load_gains(robot, directory)
        factor, publish_clock = _speed()
        names = [joint.name for joint in robot.twin_joints]
        work = find_palletise(directory)
        carried = PayloadDesk(load_payloads(directory))
        effort_percent = load_motion(directory).move.effort_percent
        world = _world(robot, config, work, carried.mounted, find_frames(directory))
        tuning = _tuning(world, robot, config, gains, gains_path(directory))
    part = part_payload(work) if work else None
    told = ToldDynamics(robot, config, carried.told, part, partial(_holds_part, world))
    with world, told:
        states = StatePorts(names, config.dt, factor, publish_clock=publish_clock)
        simulation = _simulation(world, robot, config, gains, told)
        parts = (
            PartsPorts(world, work, own_frame(robot.base_frame))
            if work and isinstance(world, PartWorld)
            else None
        )
        payload = PayloadPorts(carried, part, names, world, told, effort_percent)

        def publish(snapshots: Sequence[Snapshot]) -> None:
            # It is made below, since it needs the runner; nothing is published before that one
            # runs.
            commands.ran()
            states.publish(snapshots)
            if parts is not None:
                parts.publish(snapshots)
            if snapshots:
                payload.publish(snapshots[-1].stamp_ns)
            simulation.watched = states.watched()

        runner = RealTimeRunner(
            simulation,
            config,
            factor=factor,
            follow_system_clock=not publish_clock,
            publish=publish,
            report=DiagnosticsPort(factor, config).report,
        )
        desk = CommandDesk(simulation.control, CommandGate(robot, config), config)
        commands = CommandPorts(names, runner, desk, states)
        TuningPorts(names, runner, tuning, directory)
        payload.serve(runner)
        if parts is not None:
            parts.serve(runner)
        _run(runner)


def _run(runner: RealTimeRunner) -> None:
    """Run until a signal comes; say why the simulation died."""
    if step_efforts is None:
        rospy.logwarn("the joint loops run in Python, more slowly: ./cell build builds them in C")
    rospy.loginfo("simulator is ready")
    keep_for_good()
    go_first()
    try:
        with until_shutdown():
            runner.run(rospy.is_shutdown)
    except Exception as error:
        rospy.logfatal("the simulation has died: %s: %s", type(error).__name__, error)
        raise


def _speed() -> tuple[float, bool]:
    """Return the real-time factor and whether the clock is published."""
    factor, publish_clock = (
        rospy.get_param("~real_time_factor", 1.0),
        rospy.get_param("~publish_clock", False),
    )
    if not isinstance(publish_clock, bool):
        raise ConfigError(f"~publish_clock = {publish_clock!r}: must be true or false")
    if (
        # To Python true is the number 1.
        isinstance(factor, bool)
        or not isinstance(factor, int | float)
        or not 0.0 <= factor <= 1000.0
    ):
        raise ConfigError(f"~real_time_factor = {factor!r}: must be a number in [0, 1000]")
    if not math.isclose(factor, 1.0) and not publish_clock:
        raise ConfigError(
            f"~real_time_factor = {factor:g}: needs ~publish_clock:=true, time is not the system's"
        )
    return float(factor), publish_clock


def _holds_part(world: World) -> bool:
    return isinstance(world, PartWorld) and bool(world.suction.held)


def _world(
    robot: Robot,
    config: SimulationConfig,
    work: Palletise | None,
    mounted: Payload,
    frames: FrameTable,
) -> World:
    """Load the cell, with parts if there is work for it."""
    kind = World if work is None else partial(PartWorld, work=work, frames=frames)
    return kind(
        robot.description,
        [joint.name for joint in robot.twin_joints],
        robot.tool_frame,
        dt=config.dt,
        gravity=config.gravity_m_s2,
        dynamics=config.dynamics,
        mounted=mounted,
    )


def _tuning(
    world: World, robot: Robot, config: SimulationConfig, gains: list[LoopGains], file: Path
) -> Tuning:
    """Check the gains against the inertia that the joints see over the workspace.

    ``file`` is named in errors.
    """
    joints = robot.twin_joints
    plant = sample_plant(
        world.mass_matrix,
        [(joint.lower, joint.upper) for joint in joints],
        world.damping,
        config.dt,
        config.tracking_bandwidth_rad_s if config.feed_forward else 0.0,
    )
    try:
        return Tuning(
            [joint.name for joint in joints], gains, [joint.effort for joint in joints], plant
        )
    except TuningError as error:
        raise ConfigError(f"{file}: {error}") from error


def _simulation(
    world: World, robot: Robot, config: SimulationConfig, gains: list[LoopGains], told: ToldDynamics
) -> Simulation:
    """Put world, control and the nominal time axis together; the axis begins now."""
    start = robot.home_positions
    control = JointControl(
        joint_models(robot, config, world.damping, world.friction),
        gains,
        start,
        config.dt,
        told if config.feed_forward else None,
        config.tracking_bandwidth_rad_s,
    )
    timing = Timing(
        step_ns=config.step_ns,
        epoch_ns=time.time_ns(),
        steps_per_snapshot=config.physics_rate_hz // config.joint_states_rate_hz,
        steps_per_loop_state=config.physics_rate_hz // config.controller_state_rate_hz,
    )
    return Simulation(world, control, start, timing)
