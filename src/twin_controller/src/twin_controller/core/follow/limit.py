"""The additional controller between twin and robot: reject the invalid, limit the too fast.

A set point is rejected, never repaired; only speed is limited, and that is said. A twin that stands
at a limit overshoots it by hundredths: what lies beyond by less than the tolerance is sent as the
limit.
"""

from __future__ import annotations

import math

import msgspec

from twin_controller.core.events import Joints


class Bounds(msgspec.Struct, frozen=True):
    """What the real robot may be told, SI, one entry a joint."""

    names: tuple[str, ...]
    lower: Joints
    upper: Joints
    velocity: Joints
    units: tuple[str, ...]
    tolerance: Joints
    step_margin: float


class Passed(msgspec.Struct, frozen=True):
    """The set point that may be sent, whether it was slowed down, and why."""

    q: Joints
    limited: bool
    reason: str


class Rejected(msgspec.Struct, frozen=True):
    """Nothing may be sent; ``reason`` names the joint, the value and what is allowed."""

    reason: str


def check_setpoint(q: Joints, bounds: Bounds) -> str:
    """Return why ``q`` is invalid, or an empty text: count, not finite, range."""
    if len(q) != len(bounds.names):
        return f"{len(q)} positions for {len(bounds.names)} joints"
    for k, (name, value) in enumerate(zip(bounds.names, q)):
        lower, upper, tolerance = bounds.lower[k], bounds.upper[k], bounds.tolerance[k]
        if not math.isfinite(value):
            return f"{name} = {value} is not finite"
        if not lower - tolerance <= value <= upper + tolerance:
            return f"{name} = {value:.6g} {bounds.units[k]} is outside [{lower:.6g}, {upper:.6g}]"
    return ""


def pass_setpoint(
    q: Joints,
    last: Joints | None,
    dt: float,
    age: float,
    speed_fraction: float,
    age_limit: float,
    bounds: Bounds,
) -> Passed | Rejected:
    """Judge one set point for the real robot.

    Args:
        q: Set point, SI.
        last: The one sent before, None if there is none.
        dt: Time since then [s].
        age: Age of the twin's data it was made of [s].
        speed_fraction: Allowed part of each joint's largest speed, 0 .. 1.
        age_limit: Largest age [s].
        bounds: Limits of the robot.

    Returns:
        What may be sent, or why nothing may.
    """
    invalid = check_setpoint(q, bounds)
    if invalid:
        return Rejected(invalid)
    # Only what is beyond by less than the tolerance gets here.
    q = tuple(
        min(max(value, lower), upper) for value, lower, upper in zip(q, bounds.lower, bounds.upper)
    )
    if age > age_limit:
        return Rejected(
            f"the twin's data are {age * 1e3:.0f} ms old, allowed are {age_limit * 1e3:.0f} ms"
        )
    if last is None or dt <= 0.0:
        return Passed(q, False, "")
    steps = tuple(
        abs(new - old) / (velocity * dt) for new, old, velocity in zip(q, last, bounds.velocity)
    )
    worst = max(range(len(steps)), key=steps.__getitem__)
    name, step = bounds.names[worst], steps[worst]
    # No motion of the twin makes such a step: the data are wrong, and to limit them would hide it.
    if step > bounds.step_margin:
        way = f"{abs(q[worst] - last[worst]):.4f} {bounds.units[worst]} in {dt * 1e3:.1f} ms"
        margin = f"more than {bounds.step_margin:g} times its largest speed"
        return Rejected(f"{name} would step {way}, {margin}")
    if step <= speed_fraction * bounds.step_margin:
        return Passed(q, False, "")
    # All joints are slowed alike: the set point stays on the way.
    part = speed_fraction / step
    slowed = tuple(old + part * (new - old) for new, old in zip(q, last))
    allowed = f"allowed {100.0 * speed_fraction:.0f} %"
    return Passed(slowed, True, f"{name} at {100.0 * step:.0f} % of its largest speed, {allowed}")
