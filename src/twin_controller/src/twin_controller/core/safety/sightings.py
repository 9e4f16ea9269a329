"""Sightings of people: how old one is, and the newest of each sensor."""

from __future__ import annotations

import math

import msgspec

Place = tuple[float, float, float]


class SightingError(ValueError):
    """A sighting cannot be used; it counts as none."""


class Person(msgspec.Struct, frozen=True):
    """The nearest person that one sensor sees: when [s], where in the base frame [m], who saw."""

    seen: float
    position: Place
    sensor: str = ""


def sighting_age(frame: str, stamp: float, position: Place, now: float, base_frame: str) -> float:
    """Return how old a sighting is [s]; one from the future counts as new.

    Args:
        frame: Its frame, with or without a leading slash.
        stamp: When the person was there, ROS time [s].
        position: Where [m].
        now: ROS time [s].
        base_frame: The frame that is expected.

    Raises:
        SightingError: Another frame, no stamp, or a place that is not finite.
    """
    if frame.lstrip("/") != base_frame:
        raise SightingError(f"frame {frame!r}, expected {base_frame!r}")
    if not stamp > 0.0:
        raise SightingError(f"stamp {stamp:g} s, expected the time at which the person was there")
    if not all(map(math.isfinite, position)):
        raise SightingError(f"position {position} is not finite")
    return max(0.0, now - stamp)


def newest(people: tuple[Person, ...], person: Person) -> tuple[Person, ...]:
    """Return the newest sighting of each sensor, with ``person`` among them.

    A sensor is never forgotten: a silent one counts as a person at the robot until it is back.
    """
    known = next((other for other in people if other.sensor == person.sensor), None)
    if known is not None and known.seen > person.seen:
        return people
    return (*(other for other in people if other is not known), person)
