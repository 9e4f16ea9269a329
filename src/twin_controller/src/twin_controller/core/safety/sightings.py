"""Sightings of people: how old one is, and the newest of each sensor."""

from __future__ import annotations

import math

import msgspec

Place = tuple[float, float, float]

MOST_STRANGERS = 20
"""So many unknown senders are named; a program that is started anew has another name each time."""


class SightingError(ValueError):
    """A sighting cannot be used; it counts as none."""


class Sighting(msgspec.Struct, frozen=True):
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


def sensor_of(caller: str, namespace: str, sensors: tuple[str, ...]) -> str | None:
    """Return which of the named sensors a node is; None: none of them.

    Args:
        caller: The node's full name.
        namespace: Of the cell, with a slash at both ends.
        sensors: Names, of the cell's own nodes or with a slash before of any.
    """
    named = {name if name.startswith("/") else namespace + name: name for name in sensors}
    return named.get(caller)


def note_stranger(strangers: tuple[str, ...], caller: str) -> tuple[tuple[str, ...], str]:
    """Return who is known to be no sensor, with ``caller``, and what is to be said of it once."""
    if caller in strangers or len(strangers) > MOST_STRANGERS:
        return strangers, ""
    strangers = (*strangers, caller)
    if len(strangers) > MOST_STRANGERS:
        return strangers, "people/nearest has more unknown senders: they are dropped unnamed"
    return strangers, (
        f"people/nearest of {caller} is dropped: separation.sensors in twin_controller.yaml does "
        "not name it"
    )


def newest(
    people: tuple[Sighting, ...], person: Sighting, sensors: tuple[str, ...]
) -> tuple[Sighting, ...]:
    """Return the newest sighting of each of the named sensors, with ``person`` among them.

    Who is not named is dropped. A sensor is never forgotten: a silent one counts as a person at the
    robot until it is back.
    """
    if person.sensor not in sensors:
        return people
    known = next((other for other in people if other.sensor == person.sensor), None)
    if known is not None and known.seen > person.seen:
        return people
    return (*(other for other in people if other is not known), person)
