"""What was read of both sides becomes one cycle: evenly timed, and how long the vacuum took."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin_analysis.health.signs import Array, CycleSignals, TorqueError

LEAST = 100
"""Samples that a cycle has to have. Our choice."""
OFF, SUCKS, HOLDS = "off", "on", "holding"
"""How the state of the twin controller tells of a gripper, that it sucks, and of its vacuum."""


@dataclass(frozen=True)
class JointReadings:
    """What one side told of its joints, in the order in which it came.

    Attributes:
        names: Of its joints.
        times: When it was true [s], shape ``(n,)``.
        measured: Where they were [rad or m], shape ``(n, k)``.
        efforts: In any unit, same shape; without columns where the side told none.
    """

    names: tuple[str, ...]
    times: Array
    measured: Array
    efforts: Array


def cycle_of(
    real: JointReadings,
    twin: JointReadings,
    longest_gap: float,
    gripper: Sequence[tuple[float, str]] = (),
) -> tuple[tuple[str, ...], CycleSignals]:
    """Return the joints that both sides have, and one cycle, as long as both told theirs.

    The twin is what the robot is held to: it leads, or it follows a lag that is the same each day.

    Args:
        real: Of the robot.
        twin: Of the twin.
        longest_gap: Readings further apart than this [s] leave a hole.
        gripper: Times [s] and words of the robot's gripper, as in TwinControllerState.

    Raises:
        TorqueError: The robot told no efforts, too little was read, there is a hole in it, or they
            share no joint.
    """
    if min(len(real.times), len(twin.times)) < LEAST:
        raise TorqueError(f"less than {LEAST} samples of a side")
    if real.efforts.shape != real.measured.shape:
        raise TorqueError("the robot told no efforts: its map has no motor_torque")
    names = tuple(name for name in real.names if name in twin.names)
    if not names:
        raise TorqueError("the two sides have no joint in common")
    of_real, of_twin = ([side.names.index(name) for name in names] for side in (real, twin))
    # From when on both told something until one ended: nobody stood still for the other's sake.
    begin = max(real.times.min(), twin.times.min())
    end = min(real.times.max(), twin.times.max())
    for who, side in (("robot", real), ("twin", twin)):
        times = np.sort(side.times)
        holes = (np.diff(times) > longest_gap) & (times[1:] > begin) & (times[:-1] < end)
        if holes.any():
            # What was not recorded would be taken for a straight way, and told as wear.
            raise TorqueError(
                f"the {who} told nothing for {np.diff(times)[holes].max():.2f} s, allowed are "
                f"{longest_gap:g} s"
            )
    # The median: a robot that is read a little late now and then has the same steps.
    step = float(np.median(np.diff(real.times)))
    even = np.arange(begin, end, step)
    if len(even) < LEAST:
        raise TorqueError(f"less than {LEAST} samples of both sides at once")
    return names, CycleSignals(
        even - begin,
        _at(even, twin.times, twin.measured[:, of_twin]),
        _at(even, real.times, real.measured[:, of_real]),
        _at(even, real.times, real.efforts[:, of_real]),
        vacuum_s(gripper),
    )


def vacuum_s(gripper: Sequence[tuple[float, str]]) -> float:
    """Return how long the vacuum took, the mean of all that was gripped [s]; NaN: nothing was.

    Args:
        gripper: Times [s] and words, oldest first; what was switched off without a vacuum, or
            sucked already when it began, does not count.

    Example:
        >>> vacuum_s([(0.0, "off"), (1.0, "on"), (1.1, "on"), (1.25, "holding part_1")])
        0.25
    """
    took, since, before = [], math.nan, ""
    for time, text in gripper:
        word = text.partition(" ")[0]
        if word == SUCKS and before == OFF:
            since = time
        elif word == HOLDS and math.isfinite(since):
            took.append(time - since)
        if word != SUCKS:
            since = math.nan
        before = word
    return sum(took) / len(took) if took else math.nan


def _at(even: Array, times: Array, values: Array) -> Array:
    """Return values at even times, between those that were read."""
    # np.interp takes it for granted that times rise, and says nothing where they do not.
    order = np.argsort(times, kind="stable")
    columns = [np.interp(even, times[order], column[order]) for column in values.T]
    return np.stack(columns, axis=1)
