"""The real robot's own motion, in every mode: its pendant can start it at any time."""

from __future__ import annotations

import math

import msgspec
from scara_control.keep_out.zones import WatchedMove, free_part, heads_into, stands_in, widened

from twin_controller.config import CellLimits
from twin_controller.core.events import Joints
from twin_controller.core.safety.beside import Beside, judge_start
from twin_controller.core.safety.fastest import fastest_point
from twin_controller.core.safety.stopping import (
    Braking,
    braking_time,
    fastest_share,
    gain,
    on_path,
    rest_of_plan,
    speed_reached,
    stop_from,
    stop_on_plan,
)
from twin_controller.core.setup import Setup
from twin_controller.core.sides.change import stands_still
from twin_controller.core.sides.measure import answers
from twin_controller.core.sides.side import RealSide, Sides

replace = msgspec.structs.replace

SLOW_FROM = 0.9
"""A robot is slowed as soon as it has this part of the speed from which it can just stop."""
PERCENT_MARGIN = 1.1
"""A program's speed is told in whole percent."""
CRAWL = 0.01
"""Slower than this part of its largest speed a joint's direction means nothing."""


Ways = tuple[tuple[Joints, ...], ...]
"""What lies ahead of the robot, as far as its motion is known: ways by their corners. It is stopped
before a zone only if all of them enter one."""


class Guard(msgspec.Struct, frozen=True):
    """The real robot's motion now. At rest all is forgotten but ``beside`` and ``inside``."""

    # A program drives it, or it is faster than standstill.
    moves: bool = False
    # The zone that it cannot stop before, in words; judged anew at each sample.
    violation: str = ""
    # It could not stop before one at some time of this motion.
    violated: bool = False
    # How deep it stands in a zone after such a motion, in words; until it moves again.
    inside: str = ""
    # The part of the joints' largest speed from which it can stop before a zone ahead; 1 without
    # one. Kept up while that is less than its program asks for.
    share: float = 1.0
    # The part that its program asks for at full override; 1 if that is not known.
    asked: float = 1.0
    # How fast it may begin, for it stands beside a zone; let go once its direction is known.
    beside: Beside = Beside()
    # Since when a point is faster than the Cartesian limit allows [s]; None once none is.
    fast_since: float | None = None
    # Point, speed and limit in words, once that has lasted.
    too_fast: str = ""

    @property
    def start(self) -> float:
        """The part of its full override with which it may begin."""
        # A program that only just begins tells no speed yet.
        return self.beside.share / (self.asked if self.asked > CRAWL else 1.0)


def point_speed(setup: Setup, real: RealSide) -> tuple[float, str]:
    """Return the speed of the fastest watched point [m/s] and its name; 0 if the robot stands."""
    last = real.last
    return fastest_point(setup.speed_points, last.q, last.qdot) if any(last.qdot) else (0.0, "")


def judge_guard(
    setup: Setup,
    guard: Guard,
    real: RealSide,
    fastest: tuple[float, str],
    led: bool,
    ahead: Ways = (),
) -> Guard:
    """Judge the newest sample: whether it moves, can stop before each zone, and is slow enough.

    Args:
        setup: Profile and numbers.
        guard: As judged before.
        real: The robot; it has a sample.
        fastest: Speed of the fastest watched point [m/s], and its name.
        led: Somebody leads the pair: what begins to move counts, however slow it still is.
        ahead: What is known of its motion: see :func:`known_ahead`.
    """
    speed, name = fastest
    flags, config = real.flags, setup.config
    driven = flags is not None and flags.runs
    moves = driven or speed > config.separation.standstill_mm_s * 1e-3
    if not moves:
        inside = guard.inside
        if guard.violated:
            inside = stands_in(setup.points, setup.keep_out, real.last.q)
        guard = Guard(beside=guard.beside, inside=inside)
    elif guard.inside:
        guard = replace(guard, inside="")
    guard = replace(guard, beside=_beside(setup, guard, real, driven))
    violation, share = "", 1.0
    if setup.keep_out and speed > 0.0 and (moves or led):
        violation, share = _zone_ahead(setup, guard, real, ahead)
    guard = replace(
        guard,
        moves=moves,
        violation=violation,
        violated=guard.violated or bool(violation),
        share=share,
        asked=_asked(real),
    )
    return _too_fast(config.cell, guard, speed, name, real.last.time)


def _beside(setup: Setup, guard: Guard, real: RealSide, driven: bool) -> Beside:
    """Judge how fast the robot may begin where it stands; a pause inside a program is no stand."""
    last = real.last
    if not setup.keep_out or _share(setup, last.qdot) >= CRAWL:
        # From here on the way ahead is judged.
        return Beside()
    if driven or not stands_still(real.change, last.time, setup.config.change):
        return guard.beside
    return judge_start(setup, guard.beside, last.q, real.change.still_since)


def known_ahead(setup: Setup, sides: Sides, way: WatchedMove) -> Ways:
    """Return where a robot that follows the twin's plan is going; nothing if that is not known.

    The plan says how the motion goes on, so nothing has to be guessed from the robot's speed: one
    that brakes towards a table was taken for one that drives into it. It counts only while the
    robot does what it was told, by the tube of our own set points.

    Args:
        setup: Profile and numbers.
        sides: Both sides.
        way: The twin's announced move, as judged.
    """
    real, twin = sides.real, sides.twin
    plan = twin.plan
    if plan is None or real.flags is None or not real.flags.streaming or real.flags.own_program:
        return ()
    at = twin.clock.to_remote(real.last.time)
    if at >= plan.end or not answers(setup, real, real.last):
        return ()
    stop = stop_on_plan(plan, at, Braking(setup.braking, setup.braking_delay))
    rest = rest_of_plan(plan, at, way, setup.acceleration)
    if rest:
        return (rest, stop)
    return (stop,)


def _zone_ahead(setup: Setup, guard: Guard, real: RealSide, ahead: Ways) -> tuple[str, float]:
    """Return in words the zone that is reached even if it is stopped now, and the speed allowed."""
    q = real.last.q
    if ahead:
        found = [heads_into(setup.points, setup.keep_out, q, *way) for way in ahead]
        # One way that is free is enough: the robot may still be stopped later.
        if all(found):
            return found[-1], 1.0
        return "", 1.0
    own = real.flags is not None and real.flags.own_program
    # A robot to which nothing is written is stopped there, with no way from here in between.
    delay = setup.braking_delay if setup.writes else 0.0
    braking = Braking(setup.braking, delay, together=own)
    reached = _reached(setup, real, braking)
    stop = stop_from(q, real.last.qdot, reached, braking)
    violation = heads_into(setup.points, setup.keep_out, q, stop)
    if not setup.writes:
        return violation, 1.0
    # The override is slower than a stop: by then the robot may be faster, too.
    slowing = Braking(setup.braking, setup.slowing_delay, together=own)
    return violation, _allowed_share(setup, guard, q, _reached(setup, real, slowing), _asked(real))


def _reached(setup: Setup, real: RealSide, braking: Braking) -> Joints:
    """Return the joint velocities that the robot may have by the time at which it brakes."""
    flags, qdot, slope = real.flags, real.last.qdot, gain(real.history)
    if flags is None or not braking.together:
        return speed_reached(qdot, slope, braking.delay, setup.velocity)
    # A program is never faster than its override lets it, nor than it says itself; one that is
    # already faster than it says counts its speed in another way.
    share, percent = _share(setup, qdot), max(flags.override_percent, 1.0)
    if flags.speed_percent and share <= PERCENT_MARGIN * flags.speed_percent * 1e-2:
        percent = min(percent, PERCENT_MARGIN * flags.speed_percent)
    most = tuple(v * percent * 1e-2 for v in setup.velocity)
    reached = speed_reached(qdot, slope, braking.delay, (math.inf,) * len(qdot))
    return on_path(qdot, reached, most)


def _share(setup: Setup, qdot: Joints) -> float:
    """Return the largest joint speed as a part of what the joint can."""
    return max(abs(v) / most for v, most in zip(qdot, setup.velocity))


def _asked(real: RealSide) -> float:
    """Return the part of its joints' largest speed that the robot's program asks for."""
    flags = real.flags
    if flags is None or not flags.own_program or flags.override_percent <= 0.0:
        return 1.0
    if flags.speed_percent is None:
        return 1.0
    return min(1.0, max(flags.speed_percent / flags.override_percent, CRAWL))


def _allowed_share(setup: Setup, guard: Guard, q: Joints, reached: Joints, asked: float) -> float:
    """Return the part of the joints' largest speed from which it can stop before a zone ahead."""
    share = _share(setup, reached)
    if share < CRAWL:
        return guard.share
    full = tuple(v / share for v in reached)
    delay, duration = setup.slowing_delay, braking_time(full, setup.braking)
    # As far as it would come from the speed that its program asks for.
    most = max(asked, share)
    reach = most * delay + 0.5 * most * most * duration
    end = tuple(p + v * reach for p, v in zip(q, full))
    # A way that begins in a zone's clearance meets the zone itself.
    zones = (*widened(setup.keep_out, setup.config.cell.keep_out_clearance_mm), *setup.keep_out)
    free = free_part(setup.points, zones, q, end)
    if free >= 1.0:
        return 1.0
    allowed = fastest_share(free * reach, delay, duration)
    if guard.share >= 1.0 and share < SLOW_FROM * allowed:
        return 1.0
    return allowed


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
