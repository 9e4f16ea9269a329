"""A motion in the simulator's own world, with its control, contacts, suction and parts.

The world steps as the simulator's does, 1 ms by 1 ms; only its clock is left out, and each leg
is given as one track instead of a packet each 10 ms.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scara_config.frames import find_frames
from scara_config.payload import Payload
from scara_control.joint_track import JointTrack
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.handling.part_world_io import PartWorld
from scara_simulation.handling.payload_desk import part_payload
from scara_simulation.handling.told_dynamics_io import ToldDynamics
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.simulation import Simulation, Timing
from scipy.spatial.transform import Rotation
from typing_extensions import Self

from scara_msgs.msg import PartEvent
from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.motions import Motion
from what_if.physics import Seen, Simulated, held_up, outcome_of, planned_at, strays_mm
from what_if.timing.leg import Leg
from what_if.timing.planning import plan
from what_if.world import World

HARMS = (PartEvent.COLLISION, PartEvent.DROPPED)
SETTLING_S = 0.3
"""After the last leg, so that what was let go comes to rest; our choice."""
SNAPSHOT_S = 0.01
"""Between two looks at the joints, and between two points of a track; as joint_states_rate_hz and
rate_hz of motion.yaml."""


class SecondWorld:
    """The simulated cell, which can be put into any state; a context manager.

    Args:
        world: The cell, and what hangs at the tool.
        directory: Of the YAML files; default: the package scara_config.

    Raises:
        ConfigError: A file is missing or wrong.
        WhatIfError: The cell has no parts and no gripper.
    """

    def __init__(self, world: World, directory: Path | str | None = None) -> None:
        cell = world.cell
        if cell.work is None:
            raise WhatIfError("physics: this cell has no palletise.yaml: judge it by geometry")
        robot = cell.robot
        self._names = [joint.name for joint in robot.twin_joints]
        self._stop = [joint.acceleration for joint in robot.twin_joints]
        config = load_simulation(robot, directory)
        payload = world.payload or Payload(number=1, name="nothing", mass_kg=0.0)
        self._dt = config.dt
        self._world = PartWorld(
            robot.description,
            self._names,
            robot.tool_frame,
            dt=config.dt,
            gravity=config.gravity_m_s2,
            dynamics=config.dynamics,
            mounted=payload,
            work=cell.work,
            frames=find_frames(directory),
        )
        self._told = ToldDynamics(robot, config, payload, part_payload(cell.work), self._holds)
        self._control = JointControl(
            joint_models(robot, config, self._world.damping, self._world.friction),
            load_gains(robot, directory),
            world.q,
            config.dt,
            self._told if config.feed_forward else None,
            config.tracking_bandwidth_rad_s,
        )
        timing = Timing(config.step_ns, 0, round(SNAPSHOT_S / config.dt), config.physics_rate_hz)
        self._simulation = Simulation(self._world, self._control, world.q, timing)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._told.__exit__()
        self._world.close()

    def run(self, world: World, motion: Motion) -> Simulated:
        """Make a motion from the state of a world.

        Raises:
            WhatIfError: The question is wrong, or a part is in hand at its beginning.
        """
        legs = plan(world, motion).legs
        if not legs:
            raise WhatIfError("physics: there is no way to go: see the verdict by geometry")
        # Put joints and parts there, at rest
        if world.held:
            raise WhatIfError(
                f"physics: {world.held} is in hand at the beginning: judge it by geometry"
            )
        self._simulation.restart(world.q)
        places = {}
        for part in world.parts:
            if part.link in self._world.links:
                turn = Rotation.from_matrix(part.pose[:3, :3]).as_quat()  # x y z w
                places[part.name] = (part.link, part.pose[:3, 3].tolist(), turn.tolist())
        self._world.lay(places)
        # Laying the parts makes events of its own, and none of them is the motion's.
        self._world.happened.clear()
        self._steps, self._saturated = self._world.steps, self._control.saturated_steps
        begin, used = self._simulation.now, time.process_time()
        seen: list[Seen] = []
        most, allowed = 0.0, world.cell.config.strayed_mm
        here: Sequence[float] = world.q
        tree, tool = world.cell.tree, world.cell.robot.tool_frame
        for leg in (*legs, Leg(0.0, SETTLING_S, "")):
            if leg.grip is not None:
                # The leg lasts as long as the suction takes.
                self._world.grip(leg.grip)
            times, measured = self._make(leg)
            begun = self._simulation.now - begin - leg.duration
            strays = strays_mm(tree, tool, planned_at(leg, here, times), measured)
            most = max(most, float(strays.max(initial=0.0)))
            seen += held_up(strays, begun + times, allowed, leg.step)
            if leg.course is not None:
                here = leg.course.q[-1].tolist()
            found = []
            while self._world.happened:
                number, happening = self._world.happened.popleft()
                # The simulator calls such a part released: only its words tell the two apart.
                torn = happening.kind == PartEvent.RELEASED and "torn" in happening.message
                harm = happening.kind in HARMS or torn
                at = (number - self._steps) * self._dt
                found.append(Seen(at, leg.step, happening.message, harm))
            seen += found
        used = time.process_time() - used
        seen.sort(key=lambda each: each.time_s)
        return Simulated(
            outcome_of(seen),
            legs[-1].begin + legs[-1].duration,
            tuple(seen),
            self._control.saturated_steps - self._saturated,
            most,
            (self._simulation.now - begin) / max(used, 1e-9),
        )

    def _holds(self) -> bool:
        return bool(self._world.suction.held)

    def _make(self, leg: Leg) -> tuple[FloatArray, FloatArray]:
        """Make a leg; return when and where the joints were seen, from its beginning [s]."""
        begin, course = self._simulation.now, leg.course
        if course is not None and len(course.times) > 1:
            # As far apart as the set points of the cell: a polynomial between two lasts 10 steps.
            grid = np.arange(0.0, float(course.times[-1]), SNAPSHOT_S)
            rows = np.unique([*np.searchsorted(course.times, grid), len(course.times) - 1])
            track = JointTrack(
                (course.times[rows] + begin).tolist(),
                course.q[rows].tolist(),
                course.qdot[rows].tolist(),
                course.qddot[rows].tolist(),
                extrapolation_limit=0.0,
                stop_accelerations=self._stop,
            )
            self._control.command_track(self._names, track)
        shots = self._simulation.advance(round(leg.duration / self._dt))
        times = np.array([self._simulation.axis_time(shot.stamp_ns) - begin for shot in shots])
        return times, np.array([shot.positions for shot in shots])
