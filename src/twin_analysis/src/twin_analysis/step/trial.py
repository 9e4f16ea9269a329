"""Which steps are made with a joint, and what is told about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
from scara_config import Joint

from twin_analysis.step.response import BAND, Kind, Step, StepFigures, StepResponseError, measure

# Our choice: near the display's size of a small move, far from the effort limit of every joint.
SIZES = {"deg": 5.0, "mm": 20.0}
# Our choice: percent of the joint's largest speed.
SPEED_PERCENT = 10.0
SECONDS: dict[Kind, float] = {"position": 1.5, "velocity": 0.5}
BEFORE_S = 0.1

OVERSHOOT_PERCENT = 2.0
STEADY_ERROR = {"position": 0.01, "velocity": 0.1}
"""[deg] or [mm]: one digit of the robot's display.

Per second: a tenth of that display's change in a second. Our choice.
"""


class StepTrial(msgspec.Struct, frozen=True):
    """Steps of one joint's loop.

    ``targets`` follow each other, one for each direction, each back to where it began.

    Attributes:
        joint: The joint.
        kind: Which loop.
        targets: Set points of the two judged steps, SI.
        seconds: How long each is recorded.
    """

    joint: Joint
    kind: Kind
    targets: tuple[float, float]
    seconds: float

    @property
    def unit(self) -> str:
        """Unit of set point and value for a reader."""
        return self.joint.unit + ("/s" if self.kind == "velocity" else "")

    @property
    def effort_unit(self) -> str:
        """Unit of the control signal."""
        return "N m" if self.joint.unit == "deg" else "N"


def plan_trial(
    joint: Joint, kind: Kind, position: float, size: float | None, seconds: float | None
) -> StepTrial:
    """Choose the set points.

    A position goes up by the step and back down, a velocity from rest to plus the step, and from
    rest to minus it; where there is no room above, down first and back up.

    Args:
        joint: The joint.
        kind: Which loop.
        position: Where it stands [rad] or [m].
        size: Step in deg or mm, or per second; None: the default.
        seconds: Length of each record; None: the default.

    Raises:
        StepResponseError: The step or the record has no size, or there is no room for it.
    """
    seconds = SECONDS[kind] if seconds is None else seconds
    default = joint.velocity / joint.scale * SPEED_PERCENT / 100.0
    if kind == "position":
        default = SIZES[joint.unit]
    height = (default if size is None else size) * joint.scale
    if not height > 0.0 or not seconds > 2.0 * BEFORE_S:
        raise StepResponseError(
            f"{joint.name}: a step of {size} and {seconds:g} s is none: sizes are "
            "positive, records longer than 0.2 s"
        )
    if kind == "velocity":
        # The second step leads back to where the first began: room on one side is enough.
        for first in (height, -height):
            end = position + first * seconds
            if height <= joint.velocity and joint.lower <= end <= joint.upper:
                return StepTrial(joint, kind, (first, -first), seconds)
        raise StepResponseError(
            _no_room(
                joint, position, f"{height / joint.scale:g} {joint.unit}/s during {seconds:g} s"
            )
        )
    for end in (position + height, position - height):
        if joint.lower <= end <= joint.upper:
            return StepTrial(joint, kind, (end, position), seconds)
    raise StepResponseError(
        _no_room(joint, position, f"a step of {height / joint.scale:g} {joint.unit}")
    )


def _no_room(joint: Joint, position: float, what: str) -> str:
    low, high, speed = (value / joint.scale for value in (joint.lower, joint.upper, joint.velocity))
    return (
        f"{joint.name}: no room for {what} at {position / joint.scale:.2f} {joint.unit}: "
        f"limits are {low:g} to {high:g} {joint.unit}, {speed:g} {joint.unit}/s"
    )


def reasons(trial: StepTrial, response: StepFigures) -> list[str]:
    """Return what is wrong with a response, nothing if all limits are kept."""
    found = []
    if response.settling_time is None:
        found.append(f"it is never within {100.0 * BAND:g} % of the step for good")
    limit, error = STEADY_ERROR[trial.kind], abs(response.steady_state_error) / trial.joint.scale
    if response.overshoot_percent >= OVERSHOOT_PERCENT:
        found.append(
            f"overshoot {response.overshoot_percent:.2f} % is not below {OVERSHOOT_PERCENT:g} %"
        )
    if error >= limit:
        found.append(
            f"steady-state error {error:.4f} {trial.unit} is not below {limit:g} {trial.unit}"
        )
    if response.saturated:
        found.append(f"the effort reached its limit of {trial.joint.effort:g} {trial.effort_unit}")
    return found


def summary(trial: StepTrial, steps: Sequence[Step], where: Mapping[str, Any]) -> dict[str, Any]:
    """Return everything about a trial as a JSON document, in deg and mm.

    Args:
        trial: What was done.
        steps: The two records, in the order of the targets.
        where: More about the circumstances: which simulator, which configuration.
    """
    rows = [_row(trial, step, measure(step, trial.joint.effort)) for step in steps]
    return {
        "joint": trial.joint.name,
        "loop": trial.kind,
        "unit": trial.unit,
        "effort_unit": trial.effort_unit,
        "effort_limit": trial.joint.effort,
        **where,
        "gains": {
            name: getattr(steps[0].gains, name) for name in ("p", "i", "d", "i_clamp", "antiwindup")
        },
        "limits": {
            "overshoot_percent": OVERSHOOT_PERCENT,
            "steady_state_error": STEADY_ERROR[trial.kind],
            "saturated": False,
        },
        "steps": rows,
        "verdict": "pass" if not any(row["reasons"] for row in rows) else "FAIL",
    }


def _row(trial: StepTrial, step: Step, response: StepFigures) -> dict[str, Any]:
    """Return one step as a JSON object."""
    scale = trial.joint.scale
    return {
        "direction": "up" if step.height > 0.0 else "down",
        "start": step.start / scale,
        "target": step.target / scale,
        "rise_time_s": response.rise_time,
        "overshoot_percent": response.overshoot_percent,
        "settling_time_s": response.settling_time,
        "steady_state_error": response.steady_state_error / scale,
        "peak_effort": response.peak_effort,
        "peak_effort_percent": 100.0 * response.peak_effort / trial.joint.effort,
        "saturated": response.saturated,
        "reasons": reasons(trial, response),
    }
