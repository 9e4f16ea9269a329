"""The twin in process.

It has the simulator's world and loops, driven by recorded set points, faster than real time.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from scara_config import Robot
from scara_control.joint_motion import JointMotion
from scara_control.joint_track import JointTrack
from scara_simulation.config import SimulationConfig
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.world_io import World

from twin_analysis.fit.twin_model import FloatArray, TwinModel

SNAPSHOT_STEPS = 5


class Packet(msgspec.Struct, frozen=True):
    """One packet of the stream: when it arrived [s], and its set points, each with its time [s]."""

    arrived: float
    motions: tuple[JointMotion, ...]


class OfflineTwin:
    """Runs a recorded stream through the twin's physics."""

    def __init__(self, robot: Robot, config: SimulationConfig, urdf: Path) -> None:
        """Take the cell's description.

        Args:
            robot: robot.yaml.
            config: simulation.yaml.
            urdf: URDF of the cell.
        """
        self._robot, self._config, self._urdf = robot, config, urdf
        self._names = [joint.name for joint in robot.twin_joints]

    def run(
        self,
        model: TwinModel,
        packets: Sequence[Packet],
        recorded_delay: float,
        start: Sequence[float],
        duration: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Follow the stream from rest.

        Args:
            model: The twin's numbers.
            packets: The stream, in the order of arrival; times count from the begin of the run.
            recorded_delay: The delay with which the stamps were made [s]; the model's shifts them.
            start: Pose at time 0, SI.
            duration: Length of the run [s].

        Returns:
            Times (m,) [s] and joint positions (m, n), every ``SNAPSHOT_STEPS`` steps.
        """
        config, names = self._config, self._names
        dynamics = dict(zip(names, zip(model.damping, model.friction)))
        times, positions = [], []
        # A new one for each run: damping and friction are part of it from its beginning.
        with World(
            self._urdf,
            names,
            self._robot.tool_frame,
            dt=config.dt,
            gravity=config.gravity_m_s2,
            dynamics=dynamics,
        ) as world:
            world.reset(start)
            # The loops of a model, holding the start pose
            control = JointControl(
                joint_models(self._robot, self._config, world.damping, world.friction),
                model.gains,
                start,
                self._config.dt,
                world.inverse_dynamics if model.feed_forward else None,
                model.bandwidth,
            )
            # What was on its way for longer was true earlier.
            shift = recorded_delay - model.delay
            waiting = iter(packets)
            packet = next(waiting, None)
            for step in range(int(duration / config.dt)):
                t = step * config.dt
                while packet is not None and packet.arrived <= t:
                    control.command_track(names, self._track(packet, shift))
                    packet = next(waiting, None)
                q, qdot = world.read()
                if step % SNAPSHOT_STEPS == 0:
                    times.append(t)
                    positions.append(q)
                world.step(control.efforts(t, q, qdot))
        return np.array(times), np.array(positions)

    def _track(self, packet: Packet, shift: float) -> JointTrack:
        """Return the set points of one packet, moved by ``shift`` [s]."""
        motions = packet.motions
        return JointTrack(
            [motion.time + shift for motion in motions],
            [motion.q for motion in motions],
            [motion.qdot for motion in motions],
            [motion.qddot for motion in motions],
            extrapolation_limit=self._config.extrapolation_limit_ms * 1e-3,
            stop_accelerations=[joint.acceleration for joint in self._robot.twin_joints],
        )
