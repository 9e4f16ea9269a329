"""A recorded step of a set point and what it says about the controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import msgspec
import numpy as np
import numpy.typing as npt
from scara_control.pid import PidGains
from scara_simulation.joints.loop import LoopState

FloatArray = npt.NDArray[np.float64]
Kind = Literal["position", "velocity"]

RISE = (0.1, 0.9)
BAND = 0.02
"""Share of the step within which the joint counts as settled: the usual 2 %."""
TAIL_S = 0.2
"""The steady state is the last part of the record. Our choice."""


class StepResponseError(ValueError):
    """A record that holds no step; the text says why."""


class Step(msgspec.Struct, frozen=True):
    """One step of the set point, all arrays of shape (m,); time 0 is the command.

    Attributes:
        start: Value before the step: [rad], [m], or per second.
        target: Set point after it.
        times: [s], negative before the command.
        set_points: Commanded values.
        values: Measured values.
        efforts: Control signal [N m] or [N].
        gains: Of the loop.
    """

    start: float
    target: float
    times: FloatArray
    set_points: FloatArray
    values: FloatArray
    efforts: FloatArray
    gains: PidGains

    @property
    def height(self) -> float:
        """Target minus start."""
        return self.target - self.start

    @property
    def errors(self) -> FloatArray:
        """Set point minus measured value."""
        return self.set_points - self.values


class StepFigures(msgspec.Struct, frozen=True):
    """What a step response is judged by; lengths and angles in SI, None for what did not happen.

    Attributes:
        rise_time: From 10 % to 90 % of the step [s].
        overshoot_percent: Largest excess over the target, in percent of the step.
        settling_time: Until the joint stays within 2 % of the step [s].
        steady_state_error: Largest error (with its sign) in the last 0.2 s.
        peak_effort: Largest control signal [N m] or [N].
        saturated: Whether that is the joint's limit.
    """

    rise_time: float | None
    overshoot_percent: float
    settling_time: float | None
    steady_state_error: float
    peak_effort: float
    saturated: bool


def step_of(samples: Sequence[tuple[float, LoopState]], target: float, before: float) -> Step:
    """Cut the step to ``target`` out of a record.

    Args:
        samples: Time [s] and state of the loop, in the order of time.
        target: The commanded set point.
        before: How much of the time before the command is kept [s].

    Raises:
        StepResponseError: The set point is never ``target``, or nothing was recorded before it was.
    """
    first = next(
        (
            k
            for k, (_, state) in enumerate(samples)
            if np.isclose(state.set_point, target, rtol=0.0, atol=1e-9)
        ),
        None,
    )
    if first is None:
        raise StepResponseError(
            f"the set point {target:g} is not in the record of {len(samples)} states"
        )
    if first == 0:
        raise StepResponseError("nothing was recorded before the step")
    # The command came behind this state, before the first one that shows it.
    zero, last = samples[first - 1]
    kept = [(at - zero, state) for at, state in samples if at >= zero - before]
    return Step(
        start=last.process_value,
        target=target,
        times=np.array([at for at, _ in kept]),
        set_points=np.array([state.set_point for _, state in kept]),
        values=np.array([state.process_value for _, state in kept]),
        efforts=np.array([state.command for _, state in kept]),
        gains=kept[-1][1].gains,
    )


def measure(step: Step, effort_limit: float) -> StepFigures:
    """Compute what a step response is judged by.

    Args:
        step: The record.
        effort_limit: Of the joint [N m] or [N].

    Raises:
        StepResponseError: The step has no height.
    """
    if step.height == 0.0:
        raise StepResponseError("the step has no height")
    after = step.times >= 0.0
    times, share = step.times[after], (step.values[after] - step.start) / step.height
    outside = np.flatnonzero(np.abs(share - 1.0) > BAND)
    # Settled with the sample after the last one outside; never, if that is the last of all.
    settled: float | None = 0.0
    if outside.size:
        last = int(outside[-1])
        settled = None if last == len(share) - 1 else float(times[last + 1])
    tail = step.errors[step.times > step.times[-1] - TAIL_S]
    peak = float(np.abs(step.efforts[after]).max())
    rise = [_first_time(times, share, level) for level in RISE]
    return StepFigures(
        rise_time=None if rise[0] is None or rise[1] is None else rise[1] - rise[0],
        overshoot_percent=100.0 * max(0.0, float(share.max()) - 1.0),
        settling_time=settled,
        steady_state_error=float(tail[np.abs(tail).argmax()]),
        peak_effort=peak,
        saturated=peak >= effort_limit * (1.0 - 1e-9),
    )


def _first_time(times: FloatArray, share: FloatArray, level: float) -> float | None:
    """Return when ``share`` first reaches ``level``, between two samples by interpolation."""
    reached = np.flatnonzero(share >= level)
    if not reached.size:
        return None
    k = int(reached[0])
    if k == 0:
        return float(times[0])
    return float(np.interp(level, share[k - 1 : k + 1], times[k - 1 : k + 1]))
