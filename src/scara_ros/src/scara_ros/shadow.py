"""The pair at a time as one document: what ``twin_controller/shadow`` and ``/api/twin`` answer.

Positions and velocities stand under the joints' names, in each joint's border unit (deg, mm).
``stamp`` is ROS time at which a value was true [s]. Infinities and NaN are null in JSON.
"""

from __future__ import annotations

from typing import Any

import msgspec

Values = dict[str, float | None]
"""By joint; empty while unknown."""


class Authority(msgspec.Struct, frozen=True):
    """Who decides, and why."""

    mode: str
    leader: str
    why: str
    alarm: str


class Desired(msgspec.Struct, frozen=True):
    """What is wanted.

    Attributes:
        of: Who is told: ``real``, ``twin``, or ``both`` when the positions are the agreed ones.
        source: Who says so: ``real``, ``twin``, ``operator``, or ``agreed``.
        position: Newest set point; empty while nothing is agreed.
        target: Where the twin's running move ends; empty if there is none.
    """

    of: str
    source: str
    position: Values
    target: Values


class Reported(msgspec.Struct, frozen=True):
    """What one side last said of itself; no stamp while it is unknown."""

    position: Values
    velocity: Values
    stamp: float | None
    standing_still: bool


class Deviation(msgspec.Struct, frozen=True):
    """How far the sides are apart at the same instant.

    Attributes:
        position: Real - twin by joint.
        tool_mm: Distance of the tools, nothing removed [mm]; null: not known.
        path_mm: Of the real tool from the twin's path, lag removed [mm].
        lag: So late the follower is on its way [s]; null: nobody follows.
        follower_lag: So late the real robot does its set points [s].
        diverged: The pair came apart.
    """

    position: Values
    tool_mm: float | None
    path_mm: float
    lag: float | None
    follower_lag: float | None
    diverged: bool


class Speed(msgspec.Struct, frozen=True):
    """Program speed [percent]."""

    requested: float | None
    applied: float | None
    limited: bool
    reason: str


class Shadow(msgspec.Struct, frozen=True):
    """The pair at ``stamp`` [s]; ``units`` are deg or mm, by joint; ``links`` by side.

    ``revision`` counts documents since the controller started, ``decision`` its decisions.
    """

    stamp: float
    revision: int
    decision: int
    configuration: str
    units: dict[str, str]
    authority: Authority
    desired: Desired
    real: Reported
    twin: Reported
    deviation: Deviation
    speed: Speed
    links: dict[str, dict[str, Any]]
