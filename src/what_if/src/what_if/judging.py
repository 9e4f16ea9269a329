"""Judge a motion: from its legs, the bodies and what the gripper does to a verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from what_if.figures import Figures
from what_if.geometry.bodies import Body, FloatArray, Kind
from what_if.geometry.furnishing import furnished
from what_if.geometry.sweep import Nearest, Swept, sweep
from what_if.geometry.way import Way
from what_if.handling import MM, switch
from what_if.motions import Motion
from what_if.timing.leg import Leg, Planned
from what_if.timing.planning import plan
from what_if.timing.use import use_of
from what_if.verdict import Cause, Outcome, Reason, Verdict
from what_if.world import World
from what_if.zones import first_zone

LIMITING = (Cause.SPEED, Cause.EFFORT)
"""What makes a motion slower, but does not forbid it."""
SAMPLED = 1e-3
"""Speeds that are found from samples may be beyond a joint's own by this share; our choice."""


def judge(world: World, motion: Motion, go_on: Callable[[], None] = lambda: None) -> Verdict:
    """Judge what would come of a motion that begins in a world as it is.

    Args:
        world: The cell now.
        motion: What is asked for.
        go_on: Is called before each leg; what it raises ends the judging.

    Raises:
        WhatIfError: The question itself is wrong: an unknown joint, a speed out of range.
    """
    return judge_planned(world, plan(world, motion), go_on)[0]


def judge_planned(
    world: World, planned: Planned, go_on: Callable[[], None] = lambda: None
) -> tuple[Verdict, dict[str, float]]:
    """Judge a motion that is planned, and say how near bodies come in each of its steps.

    Args:
        world: The cell now.
        planned: Its legs.
        go_on: As of :func:`judge`.

    Returns:
        The verdict, and of each step in words the smallest clearance [m], where there is one.
    """
    if not planned.legs:
        # A program that only counts moves nothing, and nothing is against it.
        return Verdict(Outcome.REFUSED if planned.reasons else Outcome.OK, planned.reasons), {}
    trial = _Trial(world, list(planned.reasons))
    for leg in planned.legs:
        go_on()
        trial.take(leg)
    return trial.verdict(planned.legs), trial.near


class _Trial:
    """The second world while a motion goes on in it.

    Attributes:
        near: Of each step the smallest clearance [m].
    """

    def __init__(self, world: World, reasons: list[Reason]) -> None:
        self._world, self._cell = world, world.cell
        self._reasons = reasons
        self._parts, self._q = world.parts, world.q
        self._figures = Figures(len(world.q))
        self._swept: dict[bytes, Swept] = {}
        self.near: dict[str, float] = {}
        self._scene = furnished(world, self._parts)

    def take(self, leg: Leg) -> None:
        """Go through a leg."""
        if leg.course is not None:
            # Note what the leg asks of the joints
            holds = any(part.link == self._cell.robot.tool_frame for part in self._parts)
            joints = self._cell.robot.twin_joints
            use = use_of(joints, self._cell.points, self._world.models[holds], leg.course)
            self._figures.add_use(use)
            self._note(Cause.EFFORT, leg, use.effort, use.effort_at, "need {:.0f} % of its effort")
            # Where two lines of a program overlap, their speeds add up: the robot holds the joint
            # back there and leaves the way. A recorded way or a trajectory is refused by its plan.
            if leg.number >= 0 and use.speed.max() > 1.0 + SAMPLED:
                does = "be at {:.0f} % of its speed in the corner"
                self._note(Cause.SPEED, leg, use.speed, use.speed_at, does)
        if leg.way is not None:
            self._look_at_bodies(leg, leg.way)
            self._look_at_zones(leg, leg.way)
            self._q = tuple(leg.way.knots[-1].tolist())
        if leg.grip is not None:
            self._switch(leg, leg.grip)

    def _note(self, cause: Cause, leg: Leg, shares: FloatArray, at: float, does: str) -> None:
        """Note the joint that has more than all of something, at a time of a leg [s]."""
        largest = int(np.argmax(shares))
        # Told once: each later leg that needs too much would only repeat it.
        if shares[largest] > 1.0 and not any(each.cause is cause for each in self._reasons):
            name = self._cell.robot.twin_joints[largest].name
            text = f"{name} would {does.format(100.0 * shares[largest])}"
            self._reasons.append(Reason(cause, leg.begin + at, leg.step, None, text))

    def verdict(self, legs: Sequence[Leg]) -> Verdict:
        """Put the verdict together."""
        refusing = [reason for reason in self._reasons if reason.cause not in LIMITING]
        limiting = [reason for reason in self._reasons if reason.cause in LIMITING]
        outcome = Outcome.REFUSED if refusing else Outcome.LIMITED if limiting else Outcome.OK
        # What refuses comes before what limits: the first reason makes the verdict's sentence.
        refusing.sort(key=lambda reason: reason.time_s)
        last = legs[-1]
        joints = [joint.name for joint in self._cell.robot.twin_joints]
        return self._figures.verdict(
            joints,
            outcome,
            (*refusing, *limiting),
            last.begin + last.duration,
            # Single waits are independent: their variances add up, not their deviations.
            math.hypot(*(leg.spread for leg in legs)),
            self._q,
        )

    def _look_at_bodies(self, leg: Leg, way: Way) -> None:
        """Note how near bodies come, and where they hit each other."""
        # A loop goes the same way many times; a switch of the suction forgets them all.
        key = way.knots.tobytes()
        swept = self._swept.get(key)
        if swept is None:
            swept = sweep(self._scene, way, self._cell.config.nearer_mm * MM)
            self._swept[key] = swept
        if swept.nearest is not None:
            between = self._words(swept.nearest)
            distance = swept.nearest.distance
            self.near[leg.step] = min(self.near.get(leg.step, distance), distance)
            self._figures.add_clearance(swept, between, leg.time_at(swept.nearest.u))
        if swept.hit is None:
            return
        one, other = self._words(swept.hit)
        hit = self._bodies(swept.hit)[1]
        zone = hit.name if hit.kind is Kind.ZONE else ""
        does = "would enter keep-out zone" if zone else "would hit"
        # Where the two are nearest to each other [mm].
        poses, pair = self._scene.body_poses(way.at(np.array([swept.hit.u])))[0], swept.hit.pair
        ends = self._scene.distances.points(
            poses, self._scene.pairs[pair].first, self._scene.pairs[pair].second
        )
        x, y, z = (0.5 * (ends[0] + ends[1]) / MM).tolist()
        if zone:
            self._figures.add_zone(zone)
        self._reasons.append(
            Reason(
                Cause.ZONE if zone else Cause.COLLISION,
                leg.time_at(swept.hit.u),
                leg.step,
                (round(x, 1), round(y, 1), round(z, 1)),
                f"{one} {does} {other}",
            )
        )

    def _bodies(self, found: Nearest) -> tuple[Body, Body]:
        """Return the two bodies, that of the arm first."""
        pair = self._scene.pairs[found.pair]
        one, other = self._scene.bodies[pair.first], self._scene.bodies[pair.second]
        moved = (Kind.ARM, Kind.NOZZLE, Kind.HELD)
        return (one, other) if one.kind in moved else (other, one)

    def _words(self, found: Nearest) -> tuple[str, str]:
        one, other = (_named(body) for body in self._bodies(found))
        return one, other

    def _look_at_zones(self, leg: Leg, way: Way) -> None:
        """Note the zones that watched points come too near to, as the twin controller judges."""
        margin = self._cell.clearance_mm
        for zone in self._world.zones:
            found = first_zone(self._cell.points, zone, way, margin)
            if found is None:
                continue
            self._figures.add_zone(zone.name)
            text, u = found
            place = self._tool_at(way, u)
            time = leg.time_at(u)
            self._reasons.append(Reason(Cause.ZONE, time, leg.step, place, text))

    def _tool_at(self, way: Way, u: float) -> tuple[float, float, float]:
        poses: FloatArray = self._cell.tree.poses(way.at(np.array([u])))[0]
        tool = self._cell.tree.index[self._cell.robot.tool_frame]
        x, y, z = (poses[tool, :3, 3] / MM).tolist()
        return round(x, 1), round(y, 1), round(z, 1)

    def _switch(self, leg: Leg, on: bool) -> None:
        """Grip, set down or drop."""
        done = switch(self._cell, self._parts, self._q, on)
        time = leg.begin + leg.duration
        still = Way(np.array([self._q]))
        if done.placed:
            self._figures.placed.append(done.placed)
        if done.dropped:
            self._figures.dropped.append(done.part)
        for cause, text in ((Cause.DROP, done.dropped), (Cause.GRIP, done.missed)):
            if text:
                place = self._tool_at(still, 0.0)
                self._reasons.append(Reason(cause, time, leg.step, place, text))
        if done.parts != self._parts:
            self._parts = done.parts
            self._swept.clear()
            self._scene = furnished(self._world, self._parts)


def _named(body: Body) -> str:
    """Return a body in the words of somebody who stands in front of it."""
    if body.kind is Kind.HELD:
        return f"{body.name} in hand"
    return "the nozzle" if body.kind is Kind.NOZZLE else body.name
