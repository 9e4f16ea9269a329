"""Rows simulation, simulation_repeatable: speed and repeatability of the simulated cell."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import count

from scara_config import Joint
from scara_control.joint_motion import JointMotion
from scara_control.joint_track import JointTrack
from scara_control.motion.plan import plan_move
from scara_simulation.config import load_simulation
from scara_simulation.simulation import Simulation
from scara_simulation.world_io import World

from bench.peers.process import Peer
from bench.record import Beside, Goal, Record, Rounds, interleaved, median, of_rounds
from bench.room import Room
from bench.world.offline import offline_twin

STEPS, ROUNDS, PACKET_STEPS = 1000, 12, 10
BESIDE = ((-1.0, 0.5, -0.10), (-2.2, 1.5, -0.05))
"""Two poses of the arm on the pallet's side, where no part is near [rad], joint_3 [m]."""


class _Following:
    """The simulation as it follows the robot.

    Every 10 ms one set point with velocity and acceleration.
    """

    def __init__(self, room: Room, simulation: Simulation) -> None:
        """Plan the ways there and back at full speed."""
        joints, home = room.robot.twin_joints, room.robot.home_positions
        self._names, self._simulation = [joint.name for joint in joints], simulation
        self._stop = [joint.acceleration for joint in joints]
        poses = [(*pose, home[3]) for pose in BESIDE]
        self._ways = [self._way(joints, home, poses[0])]
        self._ways += [self._way(joints, poses[k % 2], poses[1 - k % 2]) for k in range(ROUNDS - 1)]

    @staticmethod
    def _way(
        joints: Sequence[Joint], begin: Sequence[float], end: Sequence[float]
    ) -> list[JointMotion]:
        path = plan_move(joints, JointMotion.at_rest(begin), end, 100.0)
        return [
            path.at(min(k * PACKET_STEPS * 1e-3, path.duration))
            for k in range(STEPS // PACKET_STEPS)
        ]

    def round(self, number: int, each: Callable[[], object] | None = None) -> float:
        """Make one way and return the seconds that it took; ``each`` is called after each step."""
        simulation, begun = self._simulation, time.perf_counter()
        for motion in self._ways[number]:
            track = JointTrack(
                [simulation.now],
                [motion.q],
                [motion.qdot],
                [motion.qddot],
                extrapolation_limit=0.05,
                stop_accelerations=self._stop,
            )
            simulation.control.command_track(self._names, track)
            if each is None:
                simulation.advance(PACKET_STEPS)
                continue
            for _ in range(PACKET_STEPS):
                simulation.advance(1)
                each()
        return time.perf_counter() - begun


def _ours(room: Room, simulation: Simulation) -> Callable[[], list[float]]:
    """Return a round of the whole simulation, as the node runs it."""
    following, numbers = _Following(room, simulation), count()
    return lambda: [following.round(next(numbers)) / STEPS]


def _recorded(room: Room) -> list[list[list[float]]]:
    """Return the efforts of each step of each round."""
    rounds: list[list[list[float]]] = []
    with offline_twin(room.robot) as (_, simulation):
        following = _Following(room, simulation)
        for number in range(ROUNDS):
            efforts: list[list[float]] = []
            following.round(
                number,
                lambda kept=efforts: kept.append(
                    list(simulation.snapshot(with_loops=False).efforts)
                ),
            )  # type: ignore[misc]
            rounds.append(efforts)
    return rounds


def _bare(world: World, recorded: list[list[list[float]]]) -> Callable[[], list[float]]:
    """Return a round that makes the same motion by the recorded efforts: nothing but physics."""
    turn = iter(recorded)

    def round_() -> list[float]:
        efforts, step = next(turn), partial(World.step, world)  # without the gripper's part
        begun = time.perf_counter()
        for effort in efforts:
            step(effort)
        return [(time.perf_counter() - begun) / STEPS]

    return round_


def _with_reading(world: World, recorded: list[list[list[float]]]) -> Callable[[], list[float]]:
    """Return the same round with the joints read at each step, as any controller must."""
    turn = iter(recorded)

    def round_() -> list[float]:
        efforts, step, read = next(turn), partial(World.step, world), world.read
        begun = time.perf_counter()
        for effort in efforts:
            step(effort)
            read()
        return [(time.perf_counter() - begun) / STEPS]

    return round_


def _mujoco(room: Room) -> Peer | None:
    """Start MuJoCo on the same URDF, if it is there."""
    config = load_simulation(room.robot, None)
    try:
        _ = room.peers
        joints = [joint.name for joint in room.robot.twin_joints]
        return Peer(
            "dynamics:Mujoco",
            urdf=str(room.robot.description),
            joints=joints,
            gravity=config.gravity_m_s2,
            step=config.dt,
        )
    except Exception as error:
        room.say(f"MuJoCo beside it: {error}")
        return None


def simulation(room: Room) -> Record:
    """Time of a physics step of the whole cell with our control, against stepping alone."""
    start = room.robot.home_positions
    peer, recorded = _mujoco(room), _recorded(room)
    with (
        offline_twin(room.robot) as (_, whole),
        offline_twin(room.robot) as (alone, _),
        offline_twin(room.robot) as (read, _),
    ):
        sides: list[Callable[[], list[float]]] = [
            _ours(room, whole),
            _bare(alone, recorded),
            _with_reading(read, recorded),
        ]
        if peer is not None:
            sides.append(lambda: peer.ask("round", steps=STEPS, pose=list(start)))
        samples = interleaved(ROUNDS, *sides)
    if peer is not None:
        peer.close()
    return _record(samples, load_simulation(room.robot, None).dt, peer.version if peer else "")


def _record(samples: list[Rounds], dt: float, mujoco: str) -> Record:
    ours, bare, torque = samples[:3]
    value, tail, spread = of_rounds(ours, median, 1e6)
    other, other_tail, other_spread = of_rounds(bare, median, 1e6)
    times = dt / median(ours)
    beside = [
        Beside("times real time", times, "x", ">= 35", times >= 35.0),
        Beside(
            "ours / PyBullet that also reads the joints at each step",
            median(ours) / median(torque),
            "",
        ),
    ]
    if len(samples) > 3:
        beside.append(
            Beside(f"{mujoco} holding the pose, same URDF, a step", median(samples[3]) * 1e6, "us")
        )
    return Record(
        "simulation",
        value,
        other,
        "us/step",
        (Goal("ratio", 1.3),),
        measured="the simulator at 1 kHz following a set point every 10 ms at full speed: tracks, "
        "PID, computed torque, physics, "
        "parts on their stands, gripper, snapshots",
        against="PyBullet alone making the same motion of the same world: recorded efforts, "
        "set and stepped, nothing computed",
        ours_p99=tail,
        baseline_p99=other_tail,
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=ROUNDS,
        beside=tuple(beside),
    )


def simulation_repeatable(room: Room) -> Record:
    """Hash all states of the same motion in two processes."""
    del room
    hashes = [
        subprocess.run(
            [sys.executable, "-m", "bench.world.repeat"],
            capture_output=True,
            text=True,
            timeout=120.0,
            check=True,
        ).stdout
        for _ in range(2)
    ]
    differing = float(hashes[0] != hashes[1] or not hashes[0])
    return Record(
        "simulation_repeatable",
        differing,
        None,
        "differing",
        (Goal("ours", 0.0),),
        measured="SHA-256 over positions, velocities and efforts of 20 s of motion, bit for "
        "bit, in two processes",
        against="the second process",
        statistic="all",
        rounds=2,
        note=f"hashes {', '.join(text.strip()[:16] for text in hashes)}",
    )
