r"""Catch up with a set point that has gone ahead, no faster than the joint.

After a stall of the machine the set points of a motion are far ahead of a joint that stood still.
Told at once, the error would pull the joint beyond its largest speed. So the set point goes there
at a bounded speed instead, and brakes in time:

.. math:: v = \dot q_s + \mathrm{sign}(e) \sqrt{2 b |e|}, \quad |v| \le v_{max}

with the error e, the set point's velocity and the deceleration b that is counted on.
"""

from __future__ import annotations

import math

from scara_control.joint_motion import AxisMotion

JUMP = 1.5
"""A set point that moves by more than so many times the largest speed has jumped. Our choice: what
a newer set point corrects is far less."""

COUNTED_ON = 0.7
"""Part of the acceleration that closing the gap brakes with. Our choice: with half of it a pair
whose simulator stood for 0.3 s came so far apart that it was paused."""

MOST = 2.0
"""The set point's velocity changes by at most so many times the acceleration: the motion's own and
that of closing the gap together."""


def has_jumped(last: AxisMotion, wanted: AxisMotion, velocity: float, dt: float) -> bool:
    """Return whether a set point is further away than any motion goes in a step.

    Args:
        last: The set point before [rad] or [m], its velocity and acceleration.
        wanted: The one that is due now.
        velocity: Largest speed of the joint.
        dt: Step [s].
    """
    return abs(wanted[0] - last[0]) > JUMP * velocity * dt


def catch_up(
    last: AxisMotion, wanted: AxisMotion, velocity: float, acceleration: float, dt: float
) -> AxisMotion:
    """Go on from ``last`` towards ``wanted`` for one step; it is ``wanted`` once it is reached.

    Args:
        last: The set point before [rad] or [m], its velocity and acceleration.
        wanted: The one that is due now.
        velocity: Largest speed of the joint.
        acceleration: Largest acceleration of the joint.
        dt: Step [s].
    """
    position, before, _ = last
    gap = wanted[0] - position - wanted[1] * dt
    # Near the end the root would leap over the gap within one step.
    closing = min(math.sqrt(2.0 * COUNTED_ON * acceleration * abs(gap)), abs(gap) / dt)
    speed = wanted[1] + math.copysign(closing, gap)
    speed = min(max(speed, -velocity), velocity)
    change = MOST * acceleration * dt
    reachable = min(max(speed, before - change), before + change)
    # By the mean of both: the position then belongs to the velocity that is told with it.
    position += 0.5 * (before + reachable) * dt
    left = abs(wanted[0] - position)
    # The velocity has to fit as well, or the set point would jump in it.
    if left <= 1e-3 * velocity * dt and abs(wanted[1] - reachable) <= change:
        return wanted
    return position, reachable, (reachable - before) / dt
