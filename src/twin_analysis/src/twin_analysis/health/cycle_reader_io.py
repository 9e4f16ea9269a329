"""Read one cycle from a recording: set points of the twin, positions and efforts of the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from cell_recorder.reading.bag_reader_io import BagError, open_bag

from twin_analysis.health.signs import Array, CycleSignals, TorqueError

REAL, TWIN = "real/joint_states", "twin/joint_states"
LEAST = 100
"""Samples that a cycle has to have. Our choice."""


def read_cycle(path: Path) -> tuple[tuple[str, ...], CycleSignals]:
    """Return the joints of both sides in a recording, and its signals.

    The twin is what the robot is held to: it leads, or it follows a lag that is the same each day.

    Raises:
        BagError: It cannot be read, or lacks a side.
        TorqueError: The robot told no efforts, or too little was recorded.
    """
    with open_bag(path) as bag:
        bag.require((REAL, TWIN))
        real = [message for _, message in bag.messages(REAL)]
        twin = [message for _, message in bag.messages(TWIN)]
    if min(len(real), len(twin)) < LEAST:
        raise TorqueError(f"{path}: less than {LEAST} samples of a side")
    if not all(len(message.effort) == len(message.name) for message in real):
        raise TorqueError(f"{path}: the robot told no efforts: its map has no motor_torque")
    names = tuple(name for name in real[0].name if name in twin[0].name)
    if not names:
        raise BagError(f"{path}: the two sides have no joint in common")
    times, moved, torques = (_column(real, names, each) for each in ("", "position", "effort"))
    begin, step = times[0, 0], float(np.median(np.diff(times[:, 0])))
    even = np.arange(begin, times[-1, 0], step)
    led = _column(twin, names, "position"), _column(twin, names, "")[:, 0]
    return names, CycleSignals(
        even - begin,
        _at(even, led[1], led[0]),
        _at(even, times[:, 0], moved),
        _at(even, times[:, 0], torques),
    )


def _column(messages: list[Any], names: tuple[str, ...], field: str) -> Array:
    """Return a field of the joints, shape ``(n, k)``; of no field: the stamps [s]."""
    if not field:
        stamps = [message.header.stamp for message in messages]
        return np.array([[stamp.sec + 1e-9 * stamp.nanosec] for stamp in stamps])
    places = [list(messages[0].name).index(name) for name in names]
    return np.array([getattr(message, field) for message in messages])[:, places]


def _at(even: Array, times: Array, values: Array) -> Array:
    """Return values at even times, between those that were read."""
    order = np.argsort(times, kind="stable")
    columns = [np.interp(even, times[order], column[order]) for column in values.T]
    return np.stack(columns, axis=1)
