"""Rows simulation, simulation_repeatable: speed and repeatability of the simulated cell."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from itertools import count

from scara_simulation.config import load_simulation
from scara_simulation.io.world import World
from scara_simulation.simulation import Simulation

from bench.peers.process import Peer
from bench.record import Beside, Goal, Record, Rounds, interleaved, median, of_rounds
from bench.room import Room
from bench.world.offline import offline_twin

STEPS, ROUNDS = 1000, 12
BESIDE = ((-1.0, 0.5, -0.10), (-2.2, 1.5, -0.05))
"""Two poses of the arm on the pallet's side, where no part is near [rad], joint_3 [m]."""


def _command(simulation: Simulation, names: list[str], number: int) -> None:
    """Send the arm to the other pose; a table that turns at full speed would throw the parts off."""
    for name, position in zip(names, BESIDE[number % 2]):
        simulation.control.command_position(name, position)


def _ours(simulation: Simulation, names: list[str]) -> Callable[[], list[float]]:
    """Return a round of the whole simulation, as the node runs it: all joints are under way."""
    numbers = count()

    def round_() -> list[float]:
        _command(simulation, names, next(numbers))
        begun = time.perf_counter()
        simulation.advance(STEPS)
        return [(time.perf_counter() - begun) / STEPS]

    return round_


def _recorded(room: Room, names: list[str]) -> list[list[list[float]]]:
    """Return the efforts of each step of each round."""
    rounds = []
    with offline_twin(room.robot) as (_, simulation):
        for number in range(ROUNDS):
            _command(simulation, names, number)
            efforts = []
            for _ in range(STEPS):
                simulation.advance(1)
                efforts.append(list(simulation.snapshot(with_loops=False).efforts))
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
            "dynamics:Mujoco", urdf=str(room.robot.description), joints=joints, gravity=config.gravity_m_s2, step=config.dt
        )
    except Exception as error:
        room.say(f"MuJoCo beside it: {error}")
        return None


def simulation(room: Room) -> Record:
    """Time of a physics step of the whole cell with our control at every step, against stepping alone."""
    names = [joint.name for joint in room.robot.twin_joints]
    start = room.robot.home_positions
    peer, recorded = _mujoco(room), _recorded(room, names)
    with offline_twin(room.robot) as (_, whole), offline_twin(room.robot) as (alone, _), offline_twin(room.robot) as (read, _):
        sides: list[Callable[[], list[float]]] = [
            _ours(whole, names),
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
        Beside("ours / PyBullet that also reads the joints at each step", median(ours) / median(torque), ""),
    ]
    if len(samples) > 3:
        beside.append(Beside(f"{mujoco} holding the pose, same URDF, a step", median(samples[3]) * 1e6, "us"))
    return Record(
        "simulation",
        value,
        other,
        "us/step",
        (Goal("ratio", 1.3),),
        measured="Simulation.advance at 1 kHz: paths, PID, computed torque, physics, parts on their stands, gripper, snapshots; "
        "the arm is under way at full speed",
        against="PyBullet alone making the same motion of the same world: recorded efforts, set and stepped, nothing computed",
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
            [sys.executable, "-m", "bench.world.repeat"], capture_output=True, text=True, timeout=120.0, check=True
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
        measured="SHA-256 over positions, velocities and efforts of 20 s of motion, bit for bit, in two processes",
        against="the second process",
        statistic="all",
        rounds=2,
        note=f"hashes {', '.join(text.strip()[:16] for text in hashes)}",
    )
