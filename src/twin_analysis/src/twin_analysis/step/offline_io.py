"""Makes steps on a simulator of its own, in process.

It has the running one's world and loops, needs no ROS master, and is faster than real time.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
from scara_config import Robot
from scara_control.pid import PidGains
from scara_simulation.config import SimulationConfig, load_gains, load_simulation
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.loop import LoopState
from scara_simulation.joints.model import joint_models
from scara_simulation.simulation import Simulation, Timing
from scara_simulation.world_io import World

from twin_analysis.step.response import Step, step_of
from twin_analysis.step.trial import BEFORE_S, StepTrial

_SETTLE_S = 0.3


class OfflineBench:
    """The twin at its start pose."""

    def __init__(
        self,
        robot: Robot,
        directory: Path | None,
        *,
        plain: bool,
        gains: Mapping[str, PidGains] | None = None,
    ) -> None:
        """Take the configuration.

        ``plain``: the article's PID, without feed-forward, whatever simulation.yaml says.
        ``gains``: of the position loops of some joints, in place of pid_gains.yaml's.

        Raises:
            ConfigError: A file is missing or wrong.
        """
        self._robot = robot
        self._config: SimulationConfig = load_simulation(robot, directory)
        self._gains = [
            msgspec.structs.replace(held, position=(gains or {}).get(joint.name, held.position))
            for joint, held in zip(robot.twin_joints, load_gains(robot, directory))
        ]
        self.feed_forward = self._config.feed_forward and not plain

    def position(self, name: str) -> float:
        """Return where a joint starts [rad] or [m]."""
        names = [joint.name for joint in self._robot.twin_joints]
        return self._robot.home_positions[names.index(name)]

    def run(self, trial: StepTrial) -> list[Step]:
        """Make the steps of a trial, one after the other."""
        config, names = self._config, [joint.name for joint in self._robot.twin_joints]
        start = self._robot.home_positions
        with World(
            self._robot.description,
            names,
            self._robot.tool_frame,
            dt=config.dt,
            gravity=config.gravity_m_s2,
            dynamics=config.dynamics,
        ) as world:
            control = JointControl(
                joint_models(self._robot, config, world.damping, world.friction),
                self._gains,
                start,
                config.dt,
                world.inverse_dynamics if self.feed_forward else None,
                config.tracking_bandwidth_rad_s,
            )
            simulation = Simulation(
                world, control, start, Timing(config.step_ns, 0, 1, config.physics_rate_hz)
            )
            simulation.watched = (names.index(trial.joint.name),)
            bench = _Bench(simulation, trial, config.dt)
            return [bench.step(target) for target in trial.targets]


class _Bench:
    """One joint of a running simulation."""

    def __init__(self, simulation: Simulation, trial: StepTrial, dt: float) -> None:
        self._simulation, self._trial, self._dt = simulation, trial, dt
        if trial.kind == "position":
            self._command(simulation.snapshot(with_loops=False).positions[simulation.watched[0]])
        # Until the loop carries the weight: without feed-forward it sags first.
        self._run(_SETTLE_S)

    def step(self, target: float) -> Step:
        """Record one step; a velocity starts from rest."""
        if self._trial.kind == "velocity":
            self._command(0.0)
            self._run(_SETTLE_S)
        record = self._run(BEFORE_S)
        self._command(target)
        return step_of(record + self._run(self._trial.seconds), target, BEFORE_S)

    def _command(self, value: float) -> None:
        name, control = self._trial.joint.name, self._simulation.control
        if self._trial.kind == "position":
            control.command_position(name, value)
        else:
            control.command_velocity(name, value)

    def _run(self, seconds: float) -> list[tuple[float, LoopState]]:
        """Advance and return time and state of the watched loop."""
        snapshots = self._simulation.advance(round(seconds / self._dt))
        return [
            (stamp_ns * 1e-9, state)
            for snapshot in snapshots
            for stamp_ns, state in snapshot.watched
        ]
