"""The article's route at full speed, as the set points that joint_pose_controller sends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scara_config import Robot
from scara_control.joint_motion import JointMotion
from scara_control.joint_track import JointTrack
from scara_control.kinematics.scara import Elbow, Scara, solve
from scara_control.motion.plan import Path, plan_move
from scara_simulation.simulation import Simulation
from scara_simulation.world_io import World

from bench.world.scara_batch import tool_positions_batch

POINTS_M = ((0.51, 0.16, 0.10), (0.51, -0.16, 0.16), (0.65, 0.0, 0.0))
"""[paper] P2, P3 and back to P1, where the twin starts."""
TABLE_RAD = (1.0, -1.0, 0.0)
"""The rotary table moves with the arm."""
HORIZON, PERIOD, SETTLE_S = 16, 0.01, 1.0
"""Points of a packet and the time between them [s], as in docs/interfaces.md.

Standing before the first move.
"""


def paths(robot: Robot, start: tuple[float, ...]) -> list[Path]:
    """Plan the moves at 100 % of the joints' speed, each from rest to rest."""
    scara, here, found = Scara.from_robot(robot), start, []
    for point, table in zip(POINTS_M, TABLE_RAD):
        target = (*solve(scara, *point, Elbow.RIGHTY).q, table)
        found.append(plan_move(robot.twin_joints, JointMotion.at_rest(here), target, 100.0))
        here = target
    return found


def with_setpoints(robot: Robot, simulation: Simulation, path: Path, t: float) -> None:
    """Send the packet that is due at time ``t`` of the path.

    From now to the horizon, with velocity and acceleration.
    """
    motions = [path.at(t + k * PERIOD) for k in range(HORIZON)]
    track = JointTrack(
        [simulation.now + k * PERIOD for k in range(HORIZON)],
        [motion.q for motion in motions],
        [motion.qdot for motion in motions],
        [motion.qddot for motion in motions],
        extrapolation_limit=0.05,
        stop_accelerations=[joint.acceleration for joint in robot.twin_joints],
    )
    simulation.control.command_track([joint.name for joint in robot.twin_joints], track)


def with_positions(robot: Robot, simulation: Simulation, path: Path, t: float) -> None:
    """Send only the position due at time ``t`` of the path, as a Float64 for each joint."""
    for joint, position in zip(robot.twin_joints, path.at(t).q):
        simulation.control.command_position(joint.name, position)


Sender = Callable[[Robot, Simulation, Path, float], None]


def tip_error_mm(
    robot: Robot, world: World, simulation: Simulation, send: Sender, period: float
) -> float:
    """Drive the route and return the tool's largest error at any instant [mm].

    Args:
        robot: robot.yaml.
        world: To be read after each step.
        simulation: At its start pose.
        send: Called every ``period`` seconds.
        period: Of the set points [s].
    """
    dt, scara = simulation.dt, Scara.from_robot(robot)
    every, wanted, reached = round(period / dt), [], []
    start = robot.home_positions
    simulation.advance(round(SETTLE_S / dt))
    for path in paths(robot, tuple(start)):
        for step in range(round(path.duration / dt)):
            if step % every == 0:
                send(robot, simulation, path, step * dt)
            simulation.advance(1)
            wanted.append(path.at((step + 1) * dt).q[:3])
            reached.append(world.read()[0][:3])
    tips = [tool_positions_batch(scara, np.array(q)) for q in (wanted, reached)]
    return float(np.linalg.norm(tips[0] - tips[1], axis=1).max()) * 1e3
