"""Read one cycle from a recording: set points of the twin, what the robot did, and its gripper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from cell_recorder.reading.bag_reader_io import open_bag

from twin_analysis.health.readings import JointReadings, cycle_of
from twin_analysis.health.signs import CycleSignals, TorqueError

REAL, TWIN, STATE = "real/joint_states", "twin/joint_states", "twin_controller/state"


def read_cycle(path: Path, longest_gap: float) -> tuple[tuple[str, ...], CycleSignals, float]:
    """Return the joints of both sides in a recording, its signals, and what they leave out.

    Args:
        path: The recording.
        longest_gap: See :func:`twin_analysis.health.readings.cycle_of`.

    Returns:
        Joints, signals, and for how long the robot was recorded without the twin [s].

    Raises:
        BagError: It cannot be read, or lacks a side.
        TorqueError: See :func:`twin_analysis.health.readings.cycle_of`.
    """
    with open_bag(path) as bag:
        bag.require((REAL, TWIN))
        real, twin = (_joints([said for _, said in bag.messages(name)]) for name in (REAL, TWIN))
        grips = [(_time(said), said.real_gripper) for _, said in bag.messages(STATE)]
    try:
        names, cycle = cycle_of(real, twin, longest_gap, grips)
    except TorqueError as error:
        raise TorqueError(f"{path}: {error}") from error
    return names, cycle, float(np.ptp(real.times) - np.ptp(cycle.times))


def _joints(messages: list[Any]) -> JointReadings:
    """Return what JointStates say."""
    has_efforts = all(len(said.effort) == len(said.name) for said in messages)
    return JointReadings(
        tuple(messages[0].name),
        np.array([_time(said) for said in messages]),
        np.array([said.position for said in messages]),
        np.array([said.effort if has_efforts else [] for said in messages]),
    )


def _time(said: Any) -> float:
    """Return when it was true [s]."""
    return float(said.header.stamp.sec + 1e-9 * said.header.stamp.nanosec)
