"""The real robot's own motion, in every mode: its pendant can start it at any time."""

from __future__ import annotations

import msgspec

from twin_controller.config import CellLimits
from twin_controller.core.events import Joints
from twin_controller.core.safety.fastest import fastest_point
from twin_controller.core.safety.zones import braking_way, heads_into, reached_speed
from twin_controller.core.setup import Setup
from twin_controller.core.sides.measure import answers
from twin_controller.core.sides.side import RealSide, Sides

replace = msgspec.structs.replace

GAIN_SAMPLES = 3
"""Over so many samples of the real robot its gain in speed is taken; two would be noise."""


class Guard(msgspec.Struct, frozen=True):
    """The real robot's motion now. All of it is forgotten when the robot comes to rest."""

    # A program drives it, or it is faster than standstill.
    moves: bool = False
    # The zone that it cannot stop before, in words; judged anew at each sample.
    violation: str = ""
    # Since when a point is faster than the Cartesian limit allows [s]; None once none is.
    fast_since: float | None = None
    # Point, speed and limit in words, once that has lasted.
    too_fast: str = ""


def point_speed(setup: Setup, real: RealSide) -> tuple[float, str]:
    """Return the speed of the fastest watched point [m/s] and its name; 0 if the robot stands."""
    last = real.last
    return fastest_point(setup.points, last.q, last.qdot) if any(last.qdot) else (0.0, "")


def judge_guard(
    setup: Setup,
    guard: Guard,
    real: RealSide,
    fastest: tuple[float, str],
    led: bool,
    planned: Joints = (),
) -> Guard:
    """Judge the newest sample: whether it moves, can stop before each zone, and is slow enough.

    Args:
        setup: Profile and numbers.
        guard: As judged before.
        real: The robot; it has a sample.
        fastest: Speed of the fastest watched point [m/s], and its name.
        led: Somebody leads the pair: what begins to move counts, however slow it still is.
        planned: Where it is going, if its motion is known: see :func:`planned_end`.
    """
    speed, name = fastest
    flags, config = real.flags, setup.config
    driven = flags is not None and (flags.own_program or flags.streaming) and not flags.paused
    moves = driven or speed > config.separation.standstill_mm_s * 1e-3
    if not moves:
        guard = Guard()
    violation = ""
    if setup.keep_out and speed > 0.0 and (moves or led):
        violation = _zone_ahead(setup, real, planned)
    guard = replace(guard, moves=moves, violation=violation)
    return _too_fast(config.cell, guard, speed, name, real.last.t)


def planned_end(setup: Setup, sides: Sides) -> Joints:
    """Return where a robot that follows the twin's plan is going; empty if that is not known.

    The plan says how the motion goes on and where it ends, so nothing has to be guessed from the
    robot's speed: one that brakes towards a table was taken for one that drives into it. It counts
    only while the robot does what it was told, by the tube of our own set points.
    """
    real, twin = sides.real, sides.twin
    plan = twin.plan
    if plan is None or real.flags is None or not real.flags.streaming or real.flags.own_program:
        return ()
    ended = twin.clock.to_remote(real.last.t) >= plan.stamp + plan.times[-1]
    if ended or not answers(setup, real, real.last):
        return ()
    q, qdot = plan.q[-1], plan.qdot[-1]
    if not any(qdot):
        return q
    # The plan goes on behind its last row: there the robot has to be able to stop, too.
    delay = setup.config.cell.braking_delay_ms * 1e-3
    return braking_way(q, qdot, setup.braking, delay, qdot)


def _zone_ahead(setup: Setup, real: RealSide, planned: Joints) -> str:
    """Return in words the zone that the robot reaches even if it is stopped now."""
    if planned:
        return heads_into(setup.points, setup.keep_out, real.last.q, planned)
    last, delay = real.last, setup.config.cell.braking_delay_ms * 1e-3
    # Until it brakes it may gain as much speed as it did just before.
    earlier = real.history[-GAIN_SAMPLES:][0]
    dt, reached = last.t - earlier.t, last.qdot
    if dt > 0.0:
        reached = reached_speed(earlier.qdot, last.qdot, dt, delay, setup.velocity)
    stop = braking_way(last.q, last.qdot, setup.braking, delay, reached)
    return heads_into(setup.points, setup.keep_out, last.q, stop)


def _too_fast(cell: CellLimits, guard: Guard, speed: float, name: str, now: float) -> Guard:
    """Judge whether the fastest point has exceeded the Cartesian limit for too long."""
    limit = cell.cartesian_speed_mm_s
    if limit is None or speed * 1e3 <= limit * cell.cartesian_margin:
        return replace(guard, fast_since=None, too_fast="")
    since = now if guard.fast_since is None else guard.fast_since
    words = ""
    # One sample may be noise.
    if now - since >= cell.cartesian_confirm_ms * 1e-3:
        words = f"the {name} at {speed * 1e3:.0f} mm/s, allowed are {limit:g} mm/s"
    return replace(guard, fast_since=since, too_fast=words)
