"""Decide whether a side moved, since when, and whether it stands still.

Positions are compared as the article does: rounded to two decimals in degrees and millimetres. A
hysteresis and n-of-m confirmation keep noise on a rounding edge from counting as a change.
"""

from __future__ import annotations

import operator

import msgspec

from twin_controller.config import Change, Settle
from twin_controller.core.events import Joints

NOISES = 5.0
"""A reading may be so many standard deviations off without a motion; our choice."""


class ChangeState(msgspec.Struct, frozen=True):
    """One side's agreed position and what has happened since; positions in border units."""

    # Agreed position, rounded; empty until taken, and again after a stop: then nothing is a change.
    baseline: Joints = ()
    # When it was taken [s], and where; from there a side that settles may lead it a little.
    taken: tuple[float, Joints] = (0.0, ())
    # For each of the last samples, whether it was outside the hysteresis.
    recent: tuple[bool, ...] = ()
    # Interpolated time of the first crossing [s]; None once all recent samples are inside again.
    onset: float | None = None
    # Last sample inside the hysteresis: time and largest deviation from the baseline.
    previous: tuple[float, float] | None = None
    # Lowest and highest position of each joint since ``still_since``.
    lowest: Joints = ()
    highest: Joints = ()
    # Running mean of the positions since then, and of how many samples, at most ``agree_samples``.
    mean: Joints = ()
    count: int = 0
    # Since when each joint stays within the tolerance of one position [s].
    still_since: float = 0.0


def widened(config: Change, noise: float) -> Change:
    """Return the thresholds for readings with this noise (border units): no less than the file's.

    Noise alone passes five standard deviations less than once in a week.
    """
    least = NOISES * noise
    if least <= min(config.hysteresis, config.still_tolerance):
        return config
    return msgspec.structs.replace(
        config,
        hysteresis=max(config.hysteresis, least),
        still_tolerance=max(config.still_tolerance, least),
    )


def take_baseline(state: ChangeState, t: float, q: Joints, config: Change) -> ChangeState:
    """Take ``q`` (border units) at ``t`` [s] as the agreed position; nothing has moved since.

    A side that stands has its mean taken: the noise of one sample would stay in every later
    comparison, and eat up half of the hysteresis.
    """
    if state.count >= config.agree_samples and len(state.mean) == len(q):
        q = state.mean
    rounded = _rounded(q, config)
    return msgspec.structs.replace(
        state, baseline=rounded, taken=(t, rounded), recent=(), onset=None, previous=None
    )


def drop_baseline(state: ChangeState) -> ChangeState:
    """Agree on nothing: nothing counts as a change until a baseline is taken."""
    return msgspec.structs.replace(state, baseline=(), recent=(), onset=None, previous=None)


def settle_reach(settling: Settle, config: Change) -> float:
    """Return how far a side that counts as standing may still settle, border units."""
    return settling.tolerance + 2.0 * config.still_tolerance


def settle(
    state: ChangeState, t: float, config: Change, duration: float, reach: float
) -> ChangeState:
    """Let the agreed position go along with a side that came to rest and goes on settling.

    A drive takes the last hundredths away for as long as it needs. Only a side that stands is
    waited for, and only while no sample looks like a change: the onset of a motion stays as it is.

    Args:
        state: What is known so far.
        t: Now [s].
        config: Rounding, samples.
        duration: How long after it was taken the agreed position may go along [s].
        reach: How far, border units.
    """
    since, place = state.taken
    if not state.baseline or state.count < config.agree_samples or any(state.recent):
        return state
    if t - since > duration or max([abs(a - b) for a, b in zip(state.mean, place)]) > reach:
        return state
    return msgspec.structs.replace(state, baseline=_rounded(state.mean, config))


def update(
    state: ChangeState, t: float, q: Joints, config: Change, echo: bool = False
) -> ChangeState:
    """Judge one sample.

    Args:
        state: What is known so far.
        t: When the sample was true [s].
        q: Joint positions, border units.
        config: Rounding, hysteresis, confirmation.
        echo: The motion is the side's answer to our own commands: it is no change and moves the
            baseline along.

    Returns:
        The new state.
    """
    state = _rested(state, t, q, config)
    if not state.baseline:
        return state
    if echo:
        return take_baseline(state, t, q, config)
    decimals = config.decimals
    deviation = max([abs(round(value, decimals) - base) for value, base in zip(q, state.baseline)])
    threshold = config.hysteresis + 0.5 * 10.0**-config.decimals
    outside = deviation > threshold
    recent = (*state.recent, outside)[-config.window :]
    onset, previous = state.onset, state.previous
    if outside and onset is None:
        onset = t
        if previous is not None and deviation > previous[1]:
            # The sample's time would be late by up to a period, and who was first is decided by
            # less: interpolate when the deviation crossed the threshold since the sample before.
            part = (threshold - previous[1]) / (deviation - previous[1])
            onset = previous[0] + part * (t - previous[0])
    if not any(recent):
        onset = None
    if not outside:
        previous = (t, deviation)
    return msgspec.structs.replace(state, recent=recent, onset=onset, previous=previous)


def _rested(state: ChangeState, t: float, q: Joints, config: Change) -> ChangeState:
    """Widen the range that the side has stayed in, or begin a new one where it is too wide.

    A range, not the distance from the first sample: noise may have put that one at its edge.
    """
    if len(state.lowest) == len(q):
        lowest, highest = tuple(map(min, state.lowest, q)), tuple(map(max, state.highest, q))
        if max(map(operator.sub, highest, lowest)) <= 2.0 * config.still_tolerance:
            count = min(state.count + 1, config.agree_samples)
            mean = tuple([old + (new - old) / count for old, new in zip(state.mean, q)])
            return msgspec.structs.replace(
                state, lowest=lowest, highest=highest, mean=mean, count=count
            )
    return msgspec.structs.replace(state, lowest=q, highest=q, mean=q, count=1, still_since=t)


def moved(state: ChangeState, config: Change) -> bool:
    """Return whether a change is confirmed."""
    return sum(state.recent) >= config.confirm


def stands_still(state: ChangeState, t: float, config: Change) -> bool:
    """Return whether the side has stayed near one position for ``still_time_ms`` at ``t`` [s]."""
    return bool(state.lowest) and t - state.still_since >= config.still_time_ms * 1e-3


def _rounded(q: Joints, config: Change) -> Joints:
    """Round a position as agreed positions are."""
    return tuple([round(value, config.decimals) for value in q])
