"""Decide whether a side moved, since when, and whether it stands still.

Positions are compared as the article does: rounded to two decimals in degrees and millimetres. A hysteresis and
n-of-m confirmation keep noise on a rounding edge from counting as a change.
"""

from __future__ import annotations

import msgspec

from twin_controller.config import Change
from twin_controller.core.events import Joints


class ChangeState(msgspec.Struct, frozen=True):
    """One side's agreed position and what has happened since.

    Attributes:
        baseline: Agreed position, rounded, border units; empty until taken.
        recent: For each of the last samples, whether it was outside the hysteresis.
        onset: Interpolated time of the first crossing [s], None if none.
        previous: Last sample inside the hysteresis: time and largest deviation from the baseline.
        anchor: Position that the standstill is measured from, border units.
        still_since: Since when the side stays near the anchor [s].
    """

    baseline: Joints = ()
    recent: tuple[bool, ...] = ()
    onset: float | None = None
    previous: tuple[float, float] | None = None
    anchor: Joints = ()
    still_since: float = 0.0


def take_baseline(state: ChangeState, q: Joints, config: Change) -> ChangeState:
    """Take ``q`` (border units) as the agreed position; nothing has moved since."""
    rounded = tuple(round(value, config.decimals) for value in q)
    return msgspec.structs.replace(state, baseline=rounded, recent=(), onset=None, previous=None)


def drop_baseline(state: ChangeState) -> ChangeState:
    """Agree on nothing: nothing counts as a change until a baseline is taken."""
    return msgspec.structs.replace(state, baseline=(), recent=(), onset=None, previous=None)


def update(state: ChangeState, t: float, q: Joints, config: Change, echo: bool = False) -> ChangeState:
    """Judge one sample.

    Args:
        state: What is known so far.
        t: When the sample was true [s].
        q: Joint positions, border units.
        config: Rounding, hysteresis, confirmation.
        echo: The motion is the side's answer to our own commands: it is no change and moves the baseline along.

    Returns:
        The new state.
    """
    anchor, still_since = state.anchor, state.still_since
    if len(anchor) != len(q) or max(abs(a - b) for a, b in zip(anchor, q)) > config.still_tolerance:
        anchor, still_since = q, t
    if not state.baseline:
        return msgspec.structs.replace(state, anchor=anchor, still_since=still_since)
    if echo:
        moved = take_baseline(state, q, config)
        return msgspec.structs.replace(moved, anchor=anchor, still_since=still_since)
    deviation = max(abs(round(value, config.decimals) - base) for value, base in zip(q, state.baseline))
    threshold = config.hysteresis + 0.5 * 10.0**-config.decimals
    outside = deviation > threshold
    recent = (*state.recent, outside)[-config.window :]
    onset, previous = state.onset, state.previous
    if outside and onset is None:
        onset = _crossing(previous, (t, deviation), threshold)
    if not any(recent):
        onset = None
    if not outside:
        previous = (t, deviation)
    return ChangeState(state.baseline, recent, onset, previous, anchor, still_since)


def moved(state: ChangeState, config: Change) -> bool:
    """Return whether a change is confirmed."""
    return sum(state.recent) >= config.confirm


def stands_still(state: ChangeState, t: float, config: Change) -> bool:
    """Return whether the side has stayed near one position for ``still_time_ms`` until ``t`` [s]."""
    return bool(state.anchor) and t - state.still_since >= config.still_time_ms * 1e-3


def _crossing(before: tuple[float, float] | None, after: tuple[float, float], threshold: float) -> float:
    """Interpolate when the deviation crossed the threshold between two samples [s]."""
    if before is None or after[1] <= before[1]:
        return after[0]
    share = (threshold - before[1]) / (after[1] - before[1])
    return before[0] + share * (after[0] - before[0])
