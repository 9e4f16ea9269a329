"""Rows oracle_kinematics, oracle_dynamics.

The same answers by other libraries, from the URDF or from robot.yaml.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scara_control.kinematics.jacobians import space_jacobian, tip_jacobian
from scara_control.kinematics.scara import Scara
from scara_control.kinematics.screws import ScrewModel, forward_kinematics_batch
from scara_simulation.config import load_simulation

from bench.peers.process import Peer
from bench.record import Beside, Goal, Record
from bench.room import Room
from bench.world.offline import offline_twin
from bench.world.scara_batch import solve_batch

POSES, STATES = 10_000, 2_000


def _poses(room: Room, count: int) -> np.ndarray:
    """Return joint positions all over the workspace, both elbows, shape ``(count, 3)``."""
    low, high = np.array([(joint.lower, joint.upper) for joint in room.robot.arm_joints]).T
    return np.random.default_rng(11).uniform(low, high, (count, 3))


def _largest(ours: Any, theirs: Any) -> float:
    return float(np.abs(np.asarray(ours) - np.asarray(theirs)).max())


def oracle_kinematics(room: Room) -> Record:
    """Poses, Jacobians and inverse kinematics against pinocchio, KDL and modern_robotics."""
    scara, arm, q = (
        Scara.from_robot(room.robot),
        ScrewModel.from_robot(room.robot),
        _poses(room, POSES),
    )
    poses = forward_kinematics_batch(arm, q)
    space = [space_jacobian(arm, row) for row in q]
    tip = [tip_jacobian(arm, row) for row in q]
    urdf, names = str(room.robot.description), [joint.name for joint in room.robot.arm_joints]
    gravity = load_simulation(room.robot, None).gravity_m_s2
    _ = room.peers
    beside = []
    with Peer(
        "dynamics:Pinocchio", urdf=urdf, joints=names, frame=room.robot.tool_frame, gravity=gravity
    ) as peer:
        found = peer.ask("kinematics", poses=q.tolist())
        beside.append(
            Beside(
                f"poses, {peer.version} on the URDF", _largest(poses, [f[0] for f in found]), "m, -"
            )
        )
        beside.append(
            Beside(
                f"tip Jacobians, {peer.version} on the URDF",
                _largest(tip, [f[1] for f in found]),
                "m/rad, -",
            )
        )
    with Peer("kinematics_oracle:KdlPoses", lengths=[scara.l1, scara.l2, scara.h]) as peer:
        found = peer.ask("kinematics", poses=q.tolist())
        beside.append(
            Beside(
                f"positions, {peer.version}", _largest(poses[:, :3, 3], [f[0] for f in found]), "m"
            )
        )
        beside.append(
            Beside(
                f"tip Jacobians, {peer.version}", _largest(tip, [f[1] for f in found]), "m/rad, -"
            )
        )
        reached = peer.ask(
            "kinematics", poses=solve_batch(scara, poses[:, :3, 3]).q[q[:, 1] >= 0.0].tolist()
        )
        wanted = poses[q[:, 1] >= 0.0, :3, 3]
        beside.append(
            Beside(
                f"where {peer.version} sees our inverse kinematics",
                _largest(wanted, [f[0] for f in reached]),
                "m",
            )
        )
    with Peer(
        "kinematics_oracle:BookPoses", screws=arm.screw_axes.tolist(), home=arm.home_pose.tolist()
    ) as peer:
        found = peer.ask("kinematics", poses=q[: POSES // 5].tolist())
        few = slice(0, POSES // 5)
        beside.append(
            Beside(
                f"poses, {peer.version}, 2000 of them",
                _largest(poses[few], [f[0] for f in found]),
                "m, -",
            )
        )
        beside.append(
            Beside(
                f"space Jacobians, {peer.version}",
                _largest(space[few], [f[1] for f in found]),
                "m/rad, -",
            )
        )
    return Record(
        "oracle_kinematics",
        max(figure.value or 0.0 for figure in beside),
        None,
        "m, m/rad, -",
        (Goal("ours", 1e-9),),
        measured=f"largest difference of any entry over {POSES} poses on both branches",
        against="none",
        statistic="max",
        beside=tuple(beside),
    )


def oracle_dynamics(room: Room) -> Record:
    """Compare the simulator's mass matrix and bias with pinocchio and MuJoCo on one URDF."""
    joints, rng = room.robot.twin_joints, np.random.default_rng(12)
    low, high = np.array([(joint.lower, joint.upper) for joint in joints]).T
    speed = np.array([joint.velocity for joint in joints])
    q = rng.uniform(low, high, (STATES, len(joints)))
    qdot = rng.uniform(-speed, speed, q.shape)
    with offline_twin(room.robot, parts=False) as (world, _):
        mass = np.array([world.mass_matrix(row.tolist()) for row in q])
        still = [0.0] * len(joints)
        bias = np.array(
            [world.inverse_dynamics(a.tolist(), b.tolist(), still) for a, b in zip(q, qdot)]
        )
    config, names = load_simulation(room.robot, None), [joint.name for joint in joints]
    urdf, states = str(room.robot.description), np.stack([q, qdot], axis=1).tolist()
    _ = room.peers
    beside = []
    for job, more in (
        ("Pinocchio", {"frame": room.robot.tool_frame}),
        ("Mujoco", {"step": config.dt}),
    ):
        with Peer(
            f"dynamics:{job}", urdf=urdf, joints=names, gravity=config.gravity_m_s2, **more
        ) as peer:
            found = peer.ask("dynamics", states=states)
            their_mass, their_bias = (np.array([f[k] for f in found]) for k in (0, 1))
        beside.append(
            Beside(
                f"mass matrix, {peer.version}",
                _largest(mass, their_mass) / float(np.abs(mass).max()),
                "",
            )
        )
        beside.append(
            Beside(
                f"bias, {peer.version}", _largest(bias, their_bias) / float(np.abs(bias).max()), ""
            )
        )
    return Record(
        "oracle_dynamics",
        max(figure.value or 0.0 for figure in beside),
        None,
        "of the largest entry",
        (Goal("ours", 1e-6),),
        measured=f"PyBullet's mass matrix and bias (velocity coupling and gravity) over {STATES} "
        "states up to full speed, as the "
        "simulator's computed torque uses them: largest difference",
        against="none",
        statistic="max",
        beside=tuple(beside),
    )
