"""Program speed of both sides: keep its caps in force, and say why it is limited."""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec

from twin_controller.config import SpeedOrders
from twin_controller.core.actions import AnyAction, CapTwin, OverrideReal
from twin_controller.core.events import RealMeasured, TwinMotion
from twin_controller.core.orders.order import Order, Patience, fresh, tell
from twin_controller.core.safety.fastest import Cap, speed_cap
from twin_controller.core.safety.watch import Safety
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Sides

replace = msgspec.structs.replace
SpeedOrder = Order[float]
"""A cap of the twin, or an override of the real robot [percent]; it is never given up."""
UNDER_WAY_PERIODS = 5
"""For so many periods of repetition the robot may still show an override: longer than a link lives
without an answer (``real_stale_ms``)."""


class Speeds(msgspec.Struct, frozen=True):
    """Program speed [percent], what of it is ordered, and why it was limited."""

    # The operator's cap for both sides.
    cap: float = 100.0
    # What the leader asks for and what it gets; shown and published, nothing is decided by them.
    # None: a robot leads that does not tell.
    requested: float | None = 0.0
    applied: float | None = 0.0
    limited: bool = False
    reason: str = ""
    # The cap that the twin was sent last; forgotten with its link, so that a new twin is told.
    twin: SpeedOrder | None = None
    # The override that the real robot was sent last.
    real: SpeedOrder | None = None
    # Those that it may still show, oldest first: what it shows of them is nobody else's.
    under_way: tuple[SpeedOrder, ...] = ()
    # What the robot is to have once nothing limits it: what was set there last; None: it has that.
    own_override: float | None = None
    # The robot's override as it was seen last; 0: it was not told yet.
    seen_override: float = 0.0


def speed_patience(config: SpeedOrders) -> Patience:
    """Return how long a side may take to show a cap or an override."""
    return Patience(config.retry_ms * 1e-3)


def cap_step(cap: float, config: SpeedOrders) -> float:
    """Return how far the twin's cap may be from ``cap`` [percent]: a small cap must be finer."""
    return min(config.step_percent, config.step_ratio * cap)


def shows_override(wanted: float, shown: float, config: SpeedOrders) -> bool:
    """Return whether the robot shows an override: it knows whole percents."""
    return abs(wanted - shown) < config.step_percent


def hear_override(
    config: SpeedOrders, speeds: Speeds, flags: RealMeasured
) -> tuple[Speeds, float | None]:
    """Return what the override was before somebody else changed it [percent], else None.

    What the robot shows of our own orders is no news. It shows them in the order in which they were
    sent, late or, with a link that ends, never.
    """
    shown, was, ours = flags.override_percent, speeds.seen_override, speeds.under_way
    own, news = speeds.own_override, None
    if shown not in (0.0, was):
        k = next((k for k, one in enumerate(ours) if shows_override(one.wanted, shown, config)), -1)
        if k < 0:
            own, news = shown, was or None
        # What was sent before it is overtaken.
        ours = ours[k + 1 :]
    elif not ours:
        return speeds, None
    late = UNDER_WAY_PERIODS * speed_patience(config).period
    ours = tuple(order for order in ours if flags.now - order.sent < late)
    seen = shown or was
    return replace(speeds, seen_override=seen, own_override=own, under_way=ours), news


OPERATORS_SPEED = "the operator's SPEED"
ZONE_AHEAD = "a keep-out zone is ahead, and a slower robot can stop before it"
ZONE_BESIDE = "it stands beside a keep-out zone, and a slower start can be stopped before it"
GIVEN_BACK = "its own override is given back, and it does not show that yet"


NOT_HELD = Cap(100.0, "")


class Leader(NamedTuple):
    """Who leads, as far as speeds depend on it, and why the last set point was slowed down."""

    name: str
    slowed: str


def cap_speeds(
    setup: Setup,
    speeds: Speeds,
    sides: Sides,
    safety: Safety,
    leader: Leader,
    pace: Cap,
    now: float,
) -> tuple[Speeds, list[AnyAction]]:
    """Send what is due, and say what was requested, what is applied, and why.

    Args:
        setup: Profile and numbers.
        speeds: What was ordered so far.
        sides: Both sides.
        safety: What is judged of the pair.
        leader: Who leads.
        pace: With what speed the real robot can be led [percent], and why with no more.
        now: Time [s].
    """
    actions: list[AnyAction] = []
    flags, motion = sides.real.flags, sides.twin.motion
    held = NOT_HELD
    if flags is not None:
        held = real_cap(setup, speeds, safety, leader.name, flags.own_program)
    if flags is not None and setup.writes:
        speeds, actions = _override_real(setup, speeds, flags, held.percent, now)
    if motion is None or not sides.twin.connected:
        return speeds, actions
    cap = _twin_cap(setup, speeds, sides, safety, pace)
    speeds = _judged(setup, speeds, sides, leader, cap, held)
    speeds, sent = _cap_twin(setup, speeds, motion, cap.percent, now)
    return speeds, [*actions, *sent]


def _judged(
    setup: Setup, speeds: Speeds, sides: Sides, leader: Leader, cap: Cap, held: Cap
) -> Speeds:
    """Say what the leader asks for, what it gets, and why that is less: the caps of both sides."""
    flags, motion = sides.real.flags, sides.twin.motion
    reason = cap.reason
    if leader.name == "real" and flags is not None:
        # A robot that leads runs at its override; what we took of that is the limit.
        requested = applied = flags.speed_percent
        limited = False
        ours = speeds.real is not None and speeds.real.wanted >= flags.override_percent
        own, order = speeds.own_override or 0.0, speeds.real
        if order is not None and own > min(order.wanted, flags.override_percent):
            limited, reason = True, held.reason if held.percent < own else GIVEN_BACK
            if requested is not None:
                # What it shows is its override times its program's speed.
                share = min(requested / max(flags.override_percent, 1.0), 1.0)
                applied = share * min(order.wanted, flags.override_percent)
                requested = share * own
        elif ours and held.percent <= flags.override_percent < 100.0:
            limited, reason = True, held.reason
    else:
        claimed = 0.0 if motion is None else motion.speed_requested_percent
        # What is measured of a twin that leads is believed over what it claims.
        measured = 0.0
        if leader.name in ("twin", "operator") and sides.twin.history:
            qdot = sides.twin.last.qdot
            measured = 100.0 * max([abs(v) / most for v, most in zip(qdot, setup.velocity)])
        requested = max(claimed, measured)
        applied = min(requested, cap.percent)
        limited = requested > applied + 0.01
    if leader.slowed and not limited:
        limited, reason = True, leader.slowed
    if not limited:
        reason = ""
    return replace(speeds, requested=requested, applied=applied, limited=limited, reason=reason)


def _cap_twin(
    setup: Setup, speeds: Speeds, motion: TwinMotion, cap: float, now: float
) -> tuple[Speeds, list[AnyAction]]:
    """Send the twin its cap if it shows another one."""
    config, order = setup.config.speed, speeds.twin
    step = cap_step(cap, config)
    if abs(motion.speed_limit_percent - cap) <= step:
        return speeds, []
    # A cap that falls is sent at once: the one that is under way allows too much.
    if order is not None and fresh(order, now) and cap > order.wanted - step:
        return speeds, []
    order = tell(order, cap, speed_patience(config), now)
    return replace(speeds, twin=order), [CapTwin(cap)]


def _twin_cap(setup: Setup, speeds: Speeds, sides: Sides, safety: Safety, pace: Cap) -> Cap:
    """Return the lowest cap of the twin's program speed."""
    limit, cartesian = setup.config.limit, setup.config.cell.cartesian_speed_mm_s
    caps = [Cap(speeds.cap, OPERATORS_SPEED)]
    if sides.real.connected and sides.real.flags is not None:
        override = max(sides.real.flags.override_percent, 1.0)
        most = sides.twin.program_speed(limit.twin_percent)
        held = f"the real robot gets at most {limit.speed_percent:g} %"
        caps.append(Cap(most, f"{held}, and it needs some of that to keep up"))
        caps.append(pace)
        room = f"the real robot's override is {override:g} %, and it needs some of that to keep up"
        caps.append(Cap(sides.twin.program_speed(override / limit.override_margin), room))
    if cartesian is not None:
        # A move that is announced has a fastest point of its own; other motion may be the worst.
        own = setup.safe_percent
        if safety.way.target:
            own = speed_cap(safety.way.peak_speed, cartesian)
        caps.append(Cap(own, _cartesian(setup)))
    caps.append(Cap(safety.separation.cap, safety.separation.reason))
    flags = sides.real.flags
    if flags is None or not flags.own_program:
        # A robot that runs a program of its own is slowed by its override.
        caps.append(Cap(100.0 * safety.guard.share, ZONE_AHEAD))
    cap = min(caps, key=lambda one: one.percent)
    return Cap(max(cap.percent, 1.0), cap.reason)


def real_cap(setup: Setup, speeds: Speeds, safety: Safety, leader: str, own_program: bool) -> Cap:
    """Return the largest override that the real robot may have.

    The operator's cap is in the set points and their program speed. Only a program of the robot's
    own knows neither, and has no other means to be slowed.
    """
    caps = [NOT_HELD]
    if own_program:
        caps.append(Cap(speeds.cap, OPERATORS_SPEED))
    if setup.config.cell.cartesian_speed_mm_s is not None:
        caps.append(Cap(setup.safe_percent, _cartesian(setup)))
    # A robot that follows is as slow as its leader, whose cap holds, and its whole way was judged.
    if leader not in ("twin", "operator"):
        caps.append(Cap(100.0 * safety.guard.start, ZONE_BESIDE))
    if leader == "real":
        caps.append(Cap(safety.separation.cap, safety.separation.reason))
        caps.append(Cap(100.0 * safety.guard.share / safety.guard.asked, ZONE_AHEAD))
    cap = min(reversed(caps), key=lambda one: one.percent)
    return Cap(_whole(cap.percent), cap.reason)


def _whole(percent: float) -> float:
    """Round down: the robot knows whole percents, and an override of 0 would stop it for good."""
    return float(max(1, math.trunc(percent)))


def _cartesian(setup: Setup) -> str:
    return f"no watched point may exceed {setup.config.cell.cartesian_speed_mm_s:g} mm/s"


def _override_real(
    setup: Setup, speeds: Speeds, flags: RealMeasured, allowed: float, now: float
) -> tuple[Speeds, list[AnyAction]]:
    """Lower the robot's override as far as its limits ask, and give it back afterwards.

    Only what zones and people took is given back. The operator's cap is not: a person who sets the
    same value meanwhile changes nothing that could be seen.
    """
    config, order, shown = setup.config.speed, speeds.real, speeds.seen_override
    if not shown:
        return speeds, []
    own = shown if speeds.own_override is None else speeds.own_override
    own = min(own, _whole(speeds.cap) if flags.own_program else 100.0)
    wanted = min(own, allowed)
    coming, waits = shown, fresh(order, now)
    if order is not None and waits and order in speeds.under_way:
        coming = order.wanted
    # Lower it at once, before the robot moves too; but not twice for the same limit. Give it back
    # in steps: between two sightings of a person the cap falls and rises a little.
    later = wanted > coming and (waits or wanted < min(own, shown + config.raise_step_percent))
    if later or shows_override(wanted, coming, config):
        # It is owed until it is shown, and nothing lower can come behind it.
        has = shows_override(own, shown, config) and not speeds.under_way
        return replace(speeds, own_override=None if has else own), []
    order = tell(order, wanted, speed_patience(config), now)
    ours = (*speeds.under_way, order)
    return replace(speeds, real=order, under_way=ours, own_override=own), [OverrideReal(wanted)]


def speed_answer(speeds: Speeds, flags: RealMeasured | None, allowed: Cap) -> str:
    """Return the answer to the operator's SPEED, ``speeds.cap``: what each side gets of it.

    A cap only lowers. What somebody has set at the robot is the most that the robot gets, and a cap
    that has lowered it is not given back: whoever stands at the robot may want what it shows.
    """
    percent = speeds.cap
    answer = f"speed of both capped at {percent:g} %"
    if flags is None:
        unreached = "the real robot is not reached: once it is, a program of its own is slowed to"
        return f"{answer}; {unreached} that, and no override is raised"
    own = speeds.own_override
    if own is None:
        own = flags.override_percent
    # The override is a whole number: less than one percent below is no limit.
    if allowed.percent < min(percent, own) - 1.0 + 1e-6:
        return f"{answer}; the real robot gets {allowed.percent:g} % for now: {allowed.reason}"
    if own < percent - 1.0 + 1e-6:
        return f"{answer}; the real robot keeps its own override of {own:g} %: raise it there"
    return answer
