"""Watch over the pair: its move's way, the real robot's motion, people, and its divergence."""

from __future__ import annotations

from typing import NamedTuple

import msgspec
from scara_control.keep_out.zones import WatchedMove, judge_way

from twin_controller.core.events import (
    AnyEvent,
    PersonSeen,
    RealMeasured,
    TwinMeasured,
    TwinMotion,
)
from twin_controller.core.safety.divergence import (
    DelayState,
    DivergenceState,
    judge_delay,
    judge_divergence,
)
from twin_controller.core.safety.guard import Guard, Ways, judge_guard, known_ahead, point_speed
from twin_controller.core.safety.separation import Distance, judge_separation
from twin_controller.core.safety.sightings import Sighting, newest
from twin_controller.core.setup import Setup
from twin_controller.core.sides.measure import answers
from twin_controller.core.sides.side import Sides, TwinSide

replace = msgspec.structs.replace


class PairTask(NamedTuple):
    """What the pair is doing, as far as safety needs it."""

    # Somebody leads the pair.
    led: bool
    # The sides should be together: somebody leads them, or both rest.
    together: bool
    # The real robot follows the twin.
    streams: bool
    # It comes to the twin, which waits for it after a pause.
    catches_up: bool = False


class Safety(msgspec.Struct, frozen=True):
    """What is judged of the pair, whoever leads it."""

    # The twin's running move as the watched points see it: from its announcement to its end.
    way: WatchedMove = WatchedMove()
    # What the real robot's own motion means for zones and the Cartesian limit.
    guard: Guard = Guard()
    # Where each of the named sensors saw the nearest person last. A sensor is never forgotten.
    people: tuple[Sighting, ...] = ()
    # Distance to the nearest of them, and what follows from it.
    separation: Distance = Distance()
    # How far the tools are apart; begins anew when the pair aligns or goes on after a pause.
    divergence: DivergenceState = DivergenceState()
    # How far at the same instant; begins anew likewise.
    delay: DelayState = DelayState()


def watch(setup: Setup, safety: Safety, sides: Sides, event: AnyEvent, task: PairTask) -> Safety:
    """Judge what one input tells.

    Args:
        setup: Profile and numbers.
        safety: As judged before.
        sides: Both sides as they were heard: what came too late to be followed is judged too.
        event: The input.
        task: What the pair is doing.
    """
    if not sides.real.history:
        # Where the robot is that is not heard, and what follows from that, nobody knows.
        safety = replace(safety, guard=Guard(), separation=Distance())
    match event:
        case PersonSeen():
            person = Sighting(event.now - event.age, event.position, event.sensor)
            sensors = setup.config.separation.sensors
            return replace(safety, people=newest(safety.people, person, sensors))
        case RealMeasured() if sides.real.history:
            return _watch_real(setup, safety, sides, task)
        case TwinMotion():
            return replace(safety, way=_judge_move(setup, safety.way, sides.twin))
        case TwinMeasured() if task.together:
            real = sides.real
            if task.catches_up and real.history and answers(setup, real, real.last):
                # It is where its set points lead it, and not yet where the twin waits.
                return safety
            judged = judge_divergence(setup, safety.divergence, sides, task.streams)
            delay = judge_delay(setup, safety.delay, sides)
            return replace(safety, divergence=judged, delay=delay)
    return safety


def _watch_real(setup: Setup, safety: Safety, sides: Sides, task: PairTask) -> Safety:
    """Judge the real robot: where it stops at the earliest, how fast it is, how far people are."""
    real, config = sides.real, setup.config.separation
    last = real.last
    fastest = point_speed(setup, real)
    # The search for the fastest pose takes a while: it is spared where nobody asks for it.
    worst = setup.fastest if config.enabled else 1.0
    separation = judge_separation(
        setup.points, safety.people, last.q, fastest[0], last.time, config, worst
    )
    ahead: Ways = ()
    if task.streams and setup.keep_out:
        ahead = known_ahead(setup, sides, safety.way)
    guard = judge_guard(setup, safety.guard, real, fastest, task.led, ahead)
    return replace(safety, separation=separation, guard=guard)


def _judge_move(setup: Setup, way: WatchedMove, twin: TwinSide) -> WatchedMove:
    """Judge the whole way of a move that the twin announces, once, before its first motion."""
    motion = twin.motion
    if motion is None or motion.state not in ("announcing", "moving"):
        return WatchedMove()
    if not motion.target or not twin.history:
        return WatchedMove()
    # The way is judged from where the move began: from here on only its rest would be.
    between = motion.way[1:-1]
    if motion.target == way.target and between == way.between:
        return way
    margin, here = setup.config.cell.keep_out_clearance_mm, twin.last.q
    zones, points, target = setup.keep_out, setup.points, motion.target
    return judge_way(points, zones, here, target, setup.velocity, margin, between)
