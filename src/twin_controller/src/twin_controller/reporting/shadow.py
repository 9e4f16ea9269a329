"""The pair at a time as one document: what is wanted, both sides, their deviation, who decides.

Positions and speeds are in each joint's border unit (deg, mm). ``stamp`` is ROS time at which a
value was true [s].
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from itertools import islice

import msgspec

from twin_controller.core.events import Joints
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Side
from twin_controller.core.state import CoreState
from twin_controller.view import LinkView, state_view

DIGITS = 4


class ShadowError(LookupError):
    """Nothing is remembered for that time; the text says from when to when something is."""


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
    position: list[float]
    target: list[float]


class Reported(msgspec.Struct, frozen=True):
    """What one side last said of itself; empty lists and no stamp while it is unknown."""

    position: list[float]
    velocity: list[float]
    stamp: float | None
    standing_still: bool


class Deviation(msgspec.Struct, frozen=True):
    """How far the sides are apart at the same instant; NaN is null in JSON.

    Attributes:
        position: Real - twin by joint.
        tool_mm: Distance of the tools, nothing removed [mm]; NaN: not known.
        path_mm: Of the real tool from the twin's path, lag removed [mm].
        lag: So late the follower is on its way [s]; NaN: nobody follows.
        follower_lag: So late the real robot does its set points [s].
        diverged: The pair came apart.
    """

    position: list[float]
    tool_mm: float
    path_mm: float
    lag: float
    follower_lag: float
    diverged: bool


class Authority(msgspec.Struct, frozen=True):
    """Who decides, and why."""

    mode: str
    leader: str
    why: str
    alarm: str


class Speed(msgspec.Struct, frozen=True):
    """Program speed [percent]."""

    requested: float
    applied: float
    limited: bool
    reason: str


class Shadow(msgspec.Struct, frozen=True):
    """The pair at ``stamp`` [s].

    ``revision`` counts documents since the controller started, ``decision`` its decisions.
    """

    stamp: float
    revision: int
    decision: int
    configuration: str
    names: list[str]
    units: list[str]
    authority: Authority
    desired: Desired
    real: Reported
    twin: Reported
    deviation: Deviation
    speed: Speed
    links: list[LinkView]


def shadow_of(
    setup: Setup,
    state: CoreState,
    now: float,
    stamp: float,
    revision: int = 0,
    configuration: str = "",
) -> Shadow:
    """Describe the pair.

    Args:
        setup: Profile and numbers.
        state: What the controller knows.
        now: Its time [s].
        stamp: The same instant in ROS time [s].
        revision: Number of this document.
        configuration: What identifies the configuration in force.
    """
    view = state_view(setup, state, now)
    return Shadow(
        stamp=stamp,
        revision=revision,
        decision=state.lead.seq,
        configuration=configuration,
        names=view.name,
        units=view.unit,
        authority=Authority(view.mode, view.leader, view.why, view.alarm),
        desired=_desired(setup, state),
        real=_reported(setup, state.sides.real, stamp - now, view.real_standing_still),
        twin=_reported(setup, state.sides.twin, stamp - now, view.twin_standing_still),
        deviation=Deviation(
            view.deviation,
            view.deviation_mm,
            view.path_deviation_mm,
            view.lag,
            view.follower_lag,
            view.diverged,
        ),
        speed=Speed(
            view.speed_requested_percent,
            view.speed_applied_percent,
            view.speed_limited,
            view.speed_reason,
        ),
        links=view.links,
    )


def _desired(setup: Setup, state: CoreState) -> Desired:
    """Return the newest set point of whoever follows, or the agreed position."""
    real, twin, follow = state.sides.real, state.sides.twin, state.follow
    target: list[float] = []
    if twin.motion is not None and twin.motion.target:
        target = _rounded(setup.to_border(twin.motion.target))
    if follow.real is not None and follow.real.last is not None:
        source = "operator" if state.lead.leader == "operator" else "twin"
        return Desired("real", source, _rounded(setup.to_border(follow.real.last.q)), target)
    if follow.twin is not None and twin.tube.commands:
        return Desired("twin", "real", _rounded(twin.tube.commands[-1][1]), target)
    agreed = real.change.baseline or twin.change.baseline
    return Desired("both", "agreed", _rounded(agreed), target)


def _reported(setup: Setup, side: Side, offset: float, still: bool) -> Reported:
    """Return the newest sample; ``offset`` is ROS time minus the controller's [s]."""
    if not side.history:
        return Reported([], [], None, still)
    last = side.last
    return Reported(
        _rounded(setup.to_border(last.q)),
        _rounded(setup.to_border(last.qdot)),
        last.time + offset,
        still,
    )


def _rounded(values: Joints) -> list[float]:
    return [round(value, DIGITS) for value in values]


class ShadowMemory:
    """The latest documents, one each period. Not thread-safe: its owner holds one lock."""

    def __init__(self, period: float, duration: float) -> None:
        """Start empty.

        Args:
            period: A document is taken this often [s].
            duration: How far back documents are kept [s].
        """
        self._period, self._duration = period, duration
        self._kept: deque[Shadow] = deque()
        self._due = -float("inf")
        self.revision = 0

    def due(self, stamp: float) -> bool:
        """Return whether the next document is due; a clock that went back does not stop them."""
        return stamp >= self._due or stamp < self._due - 2.0 * self._period

    def keep(self, shadow: Shadow) -> None:
        """Keep a document and forget those that are too old, and those from after it."""
        while self._kept and self._kept[-1].stamp >= shadow.stamp:
            self._kept.pop()
        self._kept.append(shadow)
        while self._kept[0].stamp < shadow.stamp - self._duration:
            self._kept.popleft()
        self._due = shadow.stamp + self._period
        self.revision = shadow.revision

    def at(self, time: float) -> Shadow:
        """Return the document that was true at ``time``.

        Args:
            time: ROS time [s]; 0: the newest; negative: so long before the newest.

        Raises:
            ShadowError: Nothing is kept for that time.
        """
        if not self._kept:
            raise ShadowError("nothing is remembered yet")
        first, last = self._kept[0].stamp, self._kept[-1].stamp
        wanted = time if time > 0.0 else last + time
        if not first <= wanted <= last + 2.0 * self._period:
            raise ShadowError(
                f"time = {wanted:.3f} s is not remembered: "
                f"the memory holds {first:.3f} to {last:.3f} s; "
                "older times are in the bag"
            )
        place = bisect_right([shadow.stamp for shadow in self._kept], wanted) - 1
        return next(islice(self._kept, place, None))
