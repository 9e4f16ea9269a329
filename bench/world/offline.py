"""The simulator's world and loops in this process, put together as the node ``simulator`` does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import msgspec
from scara_config import Robot
from scara_config.frames import find_frames
from scara_config.palletise import find_palletise
from scara_config.payload import load_payloads
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.handling.payload_desk import PayloadDesk, part_payload
from scara_simulation.handling.told_dynamics_io import ToldDynamics
from scara_simulation.simulation import Simulation
from scara_simulation.world_io import World

from scara_simulation import simulator_node as simulator

PLAIN_J3_CLAMP = 20.0
"""[N] Bound of joint_3's integral for plain PID, as in bench/variations.py.

Else its weight is carried by nobody.
"""


@contextmanager
def offline_twin(
    robot: Robot, *, feed_forward: bool = True, mass_factor: float = 1.0, parts: bool = True
) -> Iterator[tuple[World, Simulation]]:
    """Give the world and the simulation of the shipped configuration, without clock and ROS.

    Args:
        robot: robot.yaml.
        feed_forward: False: the article's plain PID, with the integral of joint_3 large enough for
            its weight.
        mass_factor: Masses of the feed-forward's model over those of the world.
        parts: Whether the parts lie on their stands.
    """
    config, gains = load_simulation(robot, None), load_gains(robot, None)
    config = msgspec.structs.replace(
        config, feed_forward=feed_forward, model_mass_factor=mass_factor
    )
    if not feed_forward:
        gains = [
            msgspec.structs.replace(
                gain, position=msgspec.structs.replace(gain.position, i_clamp=PLAIN_J3_CLAMP)
            )
            if joint.name == "joint_3"
            else gain
            for gain, joint in zip(gains, robot.twin_joints)
        ]
    work, carried = find_palletise(None) if parts else None, PayloadDesk(load_payloads(None))
    part = part_payload(work) if work else None
    with (
        simulator._world(robot, config, work, carried.mounted, find_frames(None)) as world,
        ToldDynamics(
            robot, config, carried.told, part, partial(simulator._holds_part, world)
        ) as told,
    ):
        yield world, simulator._simulation(world, robot, config, gains, told)
