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


def judge_setpoint(
    q: Joints,
    before: Joints | None,
    dt: float,
    slack: Joints,
    age: float,
    age_limit: float,
    bounds: Bounds,
) -> Joints | Rejected:
    """Judge what the twin asks for; what was sent of it before plays no part here.

    Args:
        q: Set point that the twin asks for, SI.
        before: The one that it asked for before; None: there is none.
        dt: Time between the two [s].
        slack: By how much the two may be off besides, since they are predictions.
        age: Age of the twin's data it was made of [s].
        age_limit: Largest age [s].
        bounds: Limits of the robot.

    Returns:
        The set point within the limits, or why it may not be sent.
    """
    invalid = check_setpoint(q, bounds)
    if invalid:
        return Rejected(invalid)
    if age > age_limit:
        return Rejected(
            f"the twin's data are {age * 1e3:.0f} ms old, allowed are {age_limit * 1e3:.0f} ms"
        )
    # Only what is beyond by less than the tolerance gets here.
    q = tuple(
        min(max(value, lower), upper) for value, lower, upper in zip(q, bounds.lower, bounds.upper)
    )
    if before is None or dt <= 0.0:
        return q
    off = [abs(new - old) - extra for new, old, extra in zip(q, before, slack)]
    steps = [step / (velocity * dt) for step, velocity in zip(off, bounds.velocity)]
    worst = max(range(len(steps)), key=steps.__getitem__)
    if steps[worst] <= bounds.step_margin:
        return q
    # No motion of the twin makes such a step: the data are wrong, and to limit them would hide it.
    way = f"{abs(q[worst] - before[worst]):.4f} {bounds.units[worst]} in {dt * 1e3:.1f} ms"
    margin = f"more than {bounds.step_margin:g} times its largest speed"
    return Rejected(f"{bounds.names[worst]} would step {way}, {margin}")


def slow_setpoint(
    q: Joints, sent: Joints | None, dt: float, speed_fraction: float, bounds: Bounds
) -> tuple[Joints, str]:
    """Go from what was sent before towards ``q``, as far as the speed allows.

    What is left is made up for by the next set points, no faster than this one. All joints are
    slowed alike: the set point stays on the way.

    Args:
        q: Set point that the twin asks for, SI.
        sent: What the real robot was told before; None: nothing.
        dt: Time that the robot has for the step [s].
        speed_fraction: Allowed part of each joint's largest speed, 0 .. 1.
        bounds: Limits of the robot.

    Returns:
        What may be sent, and why it was slowed down; empty if it was not.
    """
    if sent is None or dt <= 0.0:
        return q, ""
    # The joint that moves fastest for its largest speed, and at which part of it.
    steps = tuple(
        abs(new - old) / (velocity * dt) for new, old, velocity in zip(q, sent, bounds.velocity)
    )
    worst = max(range(len(steps)), key=steps.__getitem__)
    step = steps[worst]
    if step <= speed_fraction:
        return q, ""
    part = speed_fraction / step
    slowed = tuple(old + part * (new - old) for new, old in zip(q, sent))
    share = f"{bounds.names[worst]} at {100.0 * step:.0f} % of its largest speed"
    return slowed, f"{share}, allowed {100.0 * speed_fraction:.0f} %"
