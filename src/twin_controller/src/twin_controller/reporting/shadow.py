"""The pair at a time as one document: what is wanted, both sides, their deviation, who decides.

Its fields are told in :mod:`scara_ros.shadow`.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from itertools import islice

import msgspec
from scara_ros.shadow import Authority, Desired, Deviation, Reported, Shadow, Speed, Values

from twin_controller.core.events import Joints
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Side
from twin_controller.core.state import CoreState
from twin_controller.view import state_view

DIGITS = 4


class ShadowError(LookupError):
    """Nothing is remembered for that time; the text says from when to when something is."""


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
        units=dict(zip(view.name, view.unit)),
        authority=Authority(view.mode, view.leader, view.why, view.alarm),
        desired=_desired(setup, state),
        real=_reported(setup, state.sides.real, stamp - now, view.real_standing_still),
        twin=_reported(setup, state.sides.twin, stamp - now, view.twin_standing_still),
        deviation=Deviation(
            dict(zip(view.name, view.deviation)),
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
        links={link.pop("name"): link for link in map(msgspec.structs.asdict, view.links)},
    )


def _desired(setup: Setup, state: CoreState) -> Desired:
    """Return the newest set point of whoever follows, or the agreed position."""
    real, twin, follow = state.sides.real, state.sides.twin, state.follow
    target: Values = {}
    if twin.motion is not None and twin.motion.target:
        target = _named(setup, setup.to_border(twin.motion.target))
    if follow.real is not None and follow.real.last is not None:
        source = "operator" if state.lead.leader == "operator" else "twin"
        return Desired("real", source, _named(setup, setup.to_border(follow.real.last.q)), target)
    if follow.twin is not None and twin.tube.commands:
        return Desired("twin", "real", _named(setup, twin.tube.commands[-1][1]), target)
    agreed = real.change.baseline or twin.change.baseline
    return Desired("both", "agreed", _named(setup, agreed), target)


def _reported(setup: Setup, side: Side, offset: float, still: bool) -> Reported:
    """Return the newest sample; ``offset`` is ROS time minus the controller's [s]."""
    if not side.history:
        return Reported({}, {}, None, still)
    last = side.last
    return Reported(
        _named(setup, setup.to_border(last.q)),
        _named(setup, setup.to_border(last.qdot)),
        last.time + offset,
        still,
    )


def _named(setup: Setup, values: Joints) -> Values:
    return {name: round(value, DIGITS) for name, value in zip(setup.names, values)}


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
        # The newest counts until the next one is overdue.
        if not first <= wanted <= last + 2.0 * self._period:
            raise ShadowError(
                f"time = {wanted:.3f} s is not remembered: "
                f"the memory holds {first:.3f} to {last:.3f} s; "
                "older times are in the bag"
            )
        place = bisect_right([shadow.stamp for shadow in self._kept], wanted) - 1
        return next(islice(self._kept, place, None))
