"""Read one cycle from a recording: set points of the twin, what the robot did, and its gripper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from cell_recorder.reading.bag_reader_io import open_bag

from twin_analysis.health.readings import JointReadings, cycle_of
from twin_analysis.health.signs import CycleSignals, TorqueError

REAL, TWIN, STATE = "real/joint_states", "twin/joint_states", "twin_controller/state"


def read_cycle(path: Path) -> tuple[tuple[str, ...], CycleSignals]:
    """Return the joints of both sides in a recording, and its signals.

    Raises:
        BagError: It cannot be read, or lacks a side.
        TorqueError: The robot told no efforts, or too little was recorded.
    """
    with open_bag(path) as bag:
        bag.require((REAL, TWIN))
        real, twin = (_joints([said for _, said in bag.messages(name)]) for name in (REAL, TWIN))
        grips = [(_time(said), said.real_gripper) for _, said in bag.messages(STATE)]
    try:
        return cycle_of(real, twin, grips)
    except TorqueError as error:
        raise TorqueError(f"{path}: {error}") from error


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
