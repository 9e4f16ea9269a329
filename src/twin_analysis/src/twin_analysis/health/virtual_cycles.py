"""Cycles of a stand-in that wears, in virtual time: what the monitor is held to.

A cycle is the same each time: three fast moves of all joints together, then three slow ones, each
joint both ways. Everything is drawn by seed; nothing here is told to who looks for wear.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from fanuc_emulator.drives.group import motion_of
from fanuc_emulator.plant.config import Plant
from fanuc_emulator.plant.readings import Readings
from fanuc_emulator.plant.wear import WARM_C, Kind, Wear, at_temperature, vacuum_s, worn
from scara_config import Robot
from scara_config.programs.steps import MoveStep

from twin_analysis.health.signs import Array, CycleSignals

A_DAY, WEEK = 6, 42
"""Cycles of a day and of a week that are looked at. Our choice."""
KINDS: tuple[Kind, ...] = ("friction", "backlash", "stiffness", "payload", "vacuum")
AMOUNTS = {
    "friction": (0.5, 1.2),
    "backlash": (0.03, 0.06),
    "stiffness": (0.35, 0.6),
    "payload": (0.6, 2.0),
    "vacuum": (0.15, 0.3),
}
"""How far each kind goes at last, evenly drawn, in the units of plant/wear.py. Our choice."""
GROWS = 8
"""Cycles from the first trace of wear to all of it."""
TORQUE_NOISE_PERCENT, VACUUM_S, VACUUM_NOISE = 0.3, 0.04, 0.06
"""Rms of a torque reading; a healthy vacuum, and rms of its time as a part of it [asm]."""
FAST, SLOW, REST_S = 60.0, 1.0, 0.4
Steps = tuple[tuple[float, float], ...]
"""Where each joint is from the middle of its range: so many seconds at the speed that brings it
there [percent]. Nowhere further than ``WIDEST`` of the range."""
STEPS: Steps = ((0.35, FAST), (-0.35, FAST), (0.0, FAST), (0.6, SLOW), (0.0, SLOW), (0.6, SLOW))
WIDEST = 0.35


@dataclass(frozen=True)
class Condition:
    """Under which a cycle runs.

    Attributes:
        celsius: Of the gears.
        wears: What has worn.
    """

    celsius: float = WARM_C
    wears: tuple[Wear, ...] = ()


def drawn_wear(kind: Kind, joints: list[str], random: np.random.Generator) -> Wear:
    """Return wear of a kind, with joint and final amount by chance."""
    low, high = AMOUNTS[kind]
    joint = joints[int(random.integers(len(joints)))]
    amount = low + (high - low) * float(random.random())
    return Wear(kind, amount, joint if kind in ("friction", "backlash", "stiffness") else "")


def grown(wear: Wear, cycles: int, grows: int = GROWS) -> Wear:
    """Return how far it has gone so many cycles after its first trace; ``grows`` to all of it."""
    return Wear(wear.kind, wear.amount * min(1.0, (cycles + 1) / grows), wear.joint)


def celsius_at(cycle: int, random: np.random.Generator) -> float:
    """Return the gears' temperature: cold in the morning, warm at work, another each day [C]."""
    hour = cycle % A_DAY / A_DAY
    return WARM_C - 9.0 * float(np.exp(-3.0 * hour)) + 2.0 * float(random.standard_normal())


def run_cycle(
    robot: Robot,
    plant: Plant,
    condition: Condition,
    random: np.random.Generator,
    steps: Steps = STEPS,
) -> CycleSignals:
    """Return what a client reads while the stand-in runs one cycle.

    Args:
        robot: robot.yaml.
        plant: Of the healthy robot.
        condition: Temperature and wear.
        random: For noise, the stream's delay and the clock.
        steps: Of the cycle.
    """
    for wear in condition.wears:
        plant = worn(plant, wear)
    plant = at_temperature(plant, condition.celsius)
    joints = robot.joints
    home = [0.5 * (joint.lower + joint.upper) for joint in joints]
    motion, _ = motion_of(plant, robot, home)
    readings = Readings(plant, joints, random)
    delay = float(random.uniform(0.0, plant.stream.lag_largest_ms * 1e-3))
    rows: list[tuple[float, ...]] = []
    last, tick = None, 0
    for part, speed in steps:
        motion.start(MoveStep(1, _place(robot, part, speed), speed, fine=True))
        rested = 0
        while rested * plant.dt < REST_S:
            tick += 1
            motion.step(1.0, False)
            rested += motion.path_done
            measured = motion.measured_positions, motion.measured_velocities
            now_ms = tick * plant.servo_period_ms
            reading = readings.read(tick, *measured, now_ms, motion.torques)
            # Between two readings the registers hold the same object.
            if reading is not last:
                last = reading
                rows.append((*motion.targets, *reading.positions, *reading.torques))
    # The clock of a reading is a little off: that they come evenly is known.
    even: Array = np.arange(len(rows), dtype=np.float64) * (plant.measuring.period_ms * 1e-3)
    setpoints, positions, torques = np.array(rows).reshape(len(rows), 3, -1).swapaxes(0, 1)
    torques = torques + TORQUE_NOISE_PERCENT * random.standard_normal(torques.shape)
    # The stream is later or less late for all joints alike.
    early = np.stack([np.interp(even + delay, even, column) for column in setpoints.T], axis=1)
    noise = 1.0 + VACUUM_NOISE * float(random.standard_normal())
    return CycleSignals(even, early, positions, torques, vacuum_s(plant, VACUUM_S) * noise)


def _place(robot: Robot, seconds: float, percent: float) -> tuple[float, ...]:
    """Return where each joint is [rad or m], so far from the middle as Steps say."""
    places = []
    for joint in robot.joints:
        most = WIDEST * (joint.upper - joint.lower)
        way = seconds * 1e-2 * percent * joint.velocity
        places.append(0.5 * (joint.lower + joint.upper) + min(max(way, -most), most))
    return tuple(places)
