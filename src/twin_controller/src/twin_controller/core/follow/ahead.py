"""Set points ahead of their time, for a robot that has a ring of them.

Each says at what time of the robot's clock it counts. The ring is kept full as far as the twin's
plan tells where it goes: while the controller, or its machine, stands still for less than that, the
robot goes on. What has changed is made anew, as long as it can still get there before it counts.
"""

from __future__ import annotations

import math

import msgspec
from scara_config.modbus_map import number_after

from twin_controller.core.actions import RobotSetpoint, StreamAhead
from twin_controller.core.follow.limit import Rejected
from twin_controller.core.follow.memory import RealFollows
from twin_controller.core.follow.real import (
    Streamed,
    aimed,
    judged,
    planned,
    program_speed,
    reckon,
    twin_course,
)
from twin_controller.core.follow.response import Response
from twin_controller.core.follow.schedule import SendSlot
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import RealSide, Sides, TwinSide

replace = msgspec.structs.replace

TRIPS, SHORTEST_S, LONGEST_S = 3.0, 0.005, 0.03
"""A set point gets to the robot within so many round trips, but not sooner and not later."""

CHANGED = 0.02
"""A set point is made anew when a joint is asked for a position so far away, border units."""

UNPLANNED = 0.5
"""Without a plan, the next answer may be late by so many spacings before a set point is missing."""


def stream_ahead(
    setup: Setup,
    follows: RealFollows | None,
    sides: Sides,
    response: Response,
    cap: float,
    now: float,
) -> Streamed:
    """Make the set points that the robot has not got yet, and those that have changed.

    Args:
        setup: Profile and numbers.
        follows: What is remembered of the stream.
        sides: Both sides.
        response: How the robot answers its set points.
        cap: The operator's cap of the program speed [percent].
        now: Time [s].
    """
    if follows is None or not sides.known:
        return Streamed(follows, [])
    real, newest = sides.real, follows.last
    fixed_until = now + arrives_within(real)
    first_ms = math.ceil(1e3 * real.clock.to_remote(fixed_until))
    if follows.told:
        # What could not be changed before cannot be changed now, though answers come sooner: else
        # nothing is left to count on from, and numbers that still count would be given anew.
        fixed_until = max(fixed_until, follows.told[0].t)
        first_ms = max(first_ms, follows.told[0].clock_ms + 1)
    # By the robot's clock, which numbers and times are given in: the estimate of it moves from one
    # reading to the next. A number never gets another time while it counts: the robot hears places
    # and times one after the other, and takes a place at the wrong time while it has but one.
    fixed = [told for told in follows.told if told.clock_ms < first_ms][-1:]
    before = {told.number: told for told in follows.told if told.clock_ms >= first_ms}
    follows = replace(follows, told=tuple(fixed))
    course = twin_course(setup, sides.twin, now)
    spacing_ms = setup.config.stream.ahead_period_ms
    until = _until(setup, real, sides.twin, now, fixed_until)
    made: list[RobotSetpoint] = []
    number, clock_ms = _next(follows, real, first_ms, spacing_ms)
    while (at := real.clock.to_local(clock_ms * 1e-3)) <= until:
        old = before.get(number)
        if old is None:
            follows = reckon(setup, follows, at, response)
        follows, asked = aimed(setup, follows, sides, course, at)
        if old is None or made or _changed(setup, old.asked, asked):
            judgement = judged(setup, follows, sides, SendSlot(at, at), asked, cap, now)
            if isinstance(judgement, Rejected):
                return Streamed(follows, [], judgement.reason)
            told, slowed = judgement
            told = replace(told, number=number, clock_ms=clock_ms)
            follows = replace(follows, slowed=slowed or follows.slowed)
            made.append(told)
        else:
            told = old
        follows = replace(follows, told=(*follows.told, told))
        number, clock_ms = number_after(number), clock_ms + spacing_ms
    # One that was slowed down holds the robot back, whatever those behind it are like.
    if all(told.q == told.asked for told in follows.told):
        follows = replace(follows, slowed="")
    last = follows.last
    if last is None or (not made and newest is not None and last.number == newest.number):
        return Streamed(follows, [])
    action = StreamAhead(tuple(made), last.number, program_speed(setup, real, cap))
    return Streamed(follows, [action], "", follows.told)


def arrives_within(real: RealSide) -> float:
    """Return how long a set point is under way to the robot at most, about [s]."""
    return min(max(TRIPS * real.clock.round_trip, SHORTEST_S), LONGEST_S)


def reaches_ahead(setup: Setup, real: RealSide) -> float:
    """Return how far ahead of now the robot can have its set points [s]; 0: it takes none ahead."""
    return 1e-3 * setup.config.stream.ahead_period_ms * max(real.takes_ahead - 1, 0)


def _until(setup: Setup, real: RealSide, twin: TwinSide, now: float, fixed_until: float) -> float:
    """Return until when set points are made [s].

    All places but one: the robot may still have to take the one that counted last.
    """
    if planned(twin, now):
        return now + reaches_ahead(setup, real)
    config = setup.config
    until_next = config.real.poll_period_ms + UNPLANNED * config.stream.ahead_period_ms
    return min(fixed_until + 1e-3 * until_next, now + reaches_ahead(setup, real))


def _next(follows: RealFollows, real: RealSide, first_ms: int, spacing_ms: int) -> tuple[int, int]:
    """Return number and time [ms of the robot's clock] of the first set point that may change.

    It counts at ``first_ms`` or later.
    """
    last = follows.last
    if last is None:
        taken = real.flags.ring_read if real.flags is not None else 0
        return number_after(taken), first_ms
    # Those that were missed while nothing could be sent are left out.
    passed = max(1, math.ceil((first_ms - last.clock_ms) / spacing_ms))
    return number_after(last.number), last.clock_ms + passed * spacing_ms


def _changed(setup: Setup, before: tuple[float, ...], asked: tuple[float, ...]) -> bool:
    return any(
        abs(a - b) > CHANGED * scale for a, b, scale in zip(before, asked, setup.scale, strict=True)
    )
