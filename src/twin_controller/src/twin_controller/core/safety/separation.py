r"""Speed and separation monitoring by the protective distance of ISO/TS 15066, sec. 5.5.4.

.. math::
   S_p(v) = v_h (t_s + T_r + T_s) + v T_r + \frac{v^2}{2a} + C + Z_d + Z_r, \quad T_s = \frac{v}{a}

:math:`t_s` is the age of the sighting: since then the person may have come nearer; where the robot
is, is known now. The speed is scaled so that the distance to the nearest person is never less than
this; if it is, motion stops protectively. This is no certified safety function: the sensor, this
computer and the network are not rated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from scara_control.keep_out.points import FloatArray, WatchedPoint, all_positions

from twin_controller.config import Separation
from twin_controller.core.events import Joints
from twin_controller.core.safety.sightings import Sighting


class Distance(msgspec.Struct, frozen=True):
    """Separation now.

    Attributes:
        distance: From the nearest watched point [m]; infinite when monitoring is off.
        protective: Protective distance at the present speed [m].
        cap: Program speed that keeps the protective distance [percent].
        too_close: Motion must stop, and none may begin.
        reason: In words.
        silent: A sensor tells nothing, so nobody knows where people are.
    """

    distance: float = math.inf
    protective: float = 0.0
    cap: float = 100.0
    too_close: bool = False
    reason: str = ""
    silent: bool = False


def protective_distance(speed: float, config: Separation, age: float = 0.0) -> float:
    """Return S_p [m] for a robot moving at ``speed`` [m/s] and a person seen ``age`` [s] ago."""
    fixed = (
        config.intrusion_mm + config.sensor_uncertainty_mm + config.robot_uncertainty_mm
    ) * 1e-3
    human, reaction = config.human_speed_mm_s * 1e-3, config.reaction_ms * 1e-3
    stopping = speed / config.deceleration_m_s2
    return human * (age + reaction + stopping) + speed * reaction + 0.5 * speed * stopping + fixed


def allowed_speed(distance: float, config: Separation, age: float = 0.0) -> float:
    """Return the speed [m/s] whose protective distance is ``distance`` [m]; 0 if none has it."""
    room = distance - protective_distance(0.0, config, age)
    if room <= 0.0:
        return 0.0
    linear = config.human_speed_mm_s * 1e-3 + config.reaction_ms * 1e-3 * config.deceleration_m_s2
    return math.sqrt(linear * linear + 2.0 * config.deceleration_m_s2 * room) - linear


def judge_separation(
    points: Sequence[WatchedPoint],
    people: Sequence[Sighting],
    q: Joints,
    speed: float,
    now: float,
    config: Separation,
    fastest: float,
) -> Distance:
    """Judge the distance to the nearest person of each sensor; the worst counts.

    Args:
        points: Watched points of the arm.
        people: The newest sighting of each of the named sensors, as far as they were heard.
        q: Joint positions, SI.
        speed: Largest speed of a watched point now [m/s].
        now: Time [s].
        config: Terms of the formula.
        fastest: Speed of a watched point at 100 % program speed in the worst pose [m/s].
    """
    if not config.enabled:
        return Distance()
    heard = {person.sensor for person in people}
    if missing := [name for name in config.sensors if name not in heard]:
        return _silent(missing[0])
    if not people:
        return _silent("")
    places = all_positions(points, np.array([q]))[:, 0]
    halves = np.array([point.half for point in points])
    judged = [_judge(places, halves, person, speed, now, config, fastest) for person in people]
    return min(judged, key=lambda one: (not one.too_close, one.cap, one.distance))


def _silent(sensor: str) -> Distance:
    name = f"{sensor} " if sensor else ""
    reason = f"the sensor {name}that sees people is silent"
    return Distance(0.0, 0.0, 0.0, True, reason, silent=True)


def _judge(
    places: FloatArray,
    halves: FloatArray,
    person: Sighting,
    speed: float,
    now: float,
    config: Separation,
    fastest: float,
) -> Distance:
    """Judge the distance to one person."""
    age = max(0.0, now - person.seen)
    # Nobody seen is not the same as nobody there: a silent sensor counts as a person at the robot.
    if age > config.stale_ms * 1e-3:
        return _silent(person.sensor)
    # From the skin, not from the middle of a piece of the body: from the box around it.
    beyond = np.maximum(np.abs(places - np.array(person.position)) - halves, 0.0)
    distance = float(np.min(np.linalg.norm(beyond, axis=1)))
    protective = protective_distance(speed, config, age)
    at_rest = protective_distance(0.0, config, age)
    allowed = allowed_speed(distance - config.margin_mm * 1e-3, config, age)
    # At rest there is no speed to lose; noise in it must not stop the pair.
    too_close = distance <= at_rest or (
        speed > config.standstill_mm_s * 1e-3 and distance < protective
    )
    needed = f"the protective distance is {protective * 1e3:.0f} mm"
    reason = f"a person is {distance * 1e3:.0f} mm away, {needed}"
    return Distance(distance, protective, min(100.0, 100.0 * allowed / fastest), too_close, reason)
