"""Watch over the pair: divergence, zones, people, and the caps on both sides' speed."""

from __future__ import annotations

import msgspec
import numpy as np
from scara_control.kinematics.screws import tool_positions

from twin_controller.core.actions import AnyAction, CapTwin, OverrideReal
from twin_controller.core.observing import change
from twin_controller.core.observing.divergence import judge, path_distance
from twin_controller.core.rules.table import LEADING, Mode
from twin_controller.core.safety.guard import Guard
from twin_controller.core.safety.separation import judge_separation
from twin_controller.core.safety.zones import Way, braking_way, fastest_point, heads_into, judge_way, reached_speed, speed_cap
from twin_controller.core.state import CoreState, Setup

replace = msgspec.structs.replace

CAP_STEP = 0.5
CAP_SHARE = 0.05
RAISE_STEP = 3.0
"""An override is given back in steps of so much [percent]: between two sightings the cap falls and rises a little."""
RESEND_S = 0.2
GAIN_SAMPLES = 3
"""Over so many samples of the real robot its gain in speed is taken; two would be noise."""


def judge_divergence(setup: Setup, state: CoreState) -> CoreState:
    """Compare the tools: distance from the twin's recent and coming path while moving, plain distance at rest."""
    config = setup.config.divergence
    if not state.real.history or len(state.twin.history) < 2 or state.mode not in (*LEADING, Mode.IDLE):
        return state
    real = state.real.last
    rows = [sample.q for sample in state.twin.history if abs(sample.t - real.t) <= config.history_ms * 1e-3]
    if not rows:
        return state
    now_row = len(rows)
    if state.stream is not None and state.plan is not None:
        rows += state.plan.q
    columns = setup.arm_columns
    points = tool_positions(setup.arm, np.array([real.q, *rows])[:, columns])
    still = all(change.stands_still(side.change, real.t, setup.config.change) for side in (state.real, state.twin))
    limit = config.rest_mm if still else config.path_mm
    distance = float(np.linalg.norm(points[0] - points[now_row])) if still else path_distance(points[0], points[1:])
    return replace(state, divergence=judge(state.divergence, distance, limit, config))


def judge_move(setup: Setup, state: CoreState) -> CoreState:
    """Judge the whole way of a move that the twin announces, once, before its first motion."""
    motion = state.motion
    if motion is None or motion.state not in ("announcing", "moving") or not motion.target or not state.twin.history:
        return replace(state, way=Way()) if state.way != Way() else state
    if motion.target == state.way.target:
        return state
    way = judge_way(setup.points, setup.keep_out, state.twin.last.q, motion.target, setup.velocity)
    return replace(state, way=way)


def watch_real(setup: Setup, state: CoreState) -> CoreState:
    """Judge the real robot's motion: where it can stop at the earliest, how fast it is, how far people are."""
    if not state.real.history:
        return state
    last, config = state.real.last, setup.config.separation
    speed, name = fastest_point(setup.points, last.q, last.qdot) if any(last.qdot) else (0.0, "")
    fastest = setup.fastest if config.enabled else 1.0
    separation = judge_separation(setup.points, state.people, last.q, speed, last.t, config, fastest)
    guard = _too_fast(setup, _guarded(setup, state, speed), speed, name, last.t)
    return replace(state, separation=separation, guard=guard)


def _too_fast(setup: Setup, guard: Guard, speed: float, name: str, now: float) -> Guard:
    """Judge whether the fastest point has exceeded the Cartesian limit for too long, whoever leads."""
    cell = setup.config.cell
    limit = cell.cartesian_speed_mm_s
    if limit is None or speed * 1e3 <= limit * cell.cartesian_margin:
        return replace(guard, fast_since=None, too_fast="")
    since = now if guard.fast_since is None else guard.fast_since
    lasts = now - since >= cell.cartesian_confirm_ms * 1e-3
    words = f"the {name} at {speed * 1e3:.0f} mm/s, allowed are {limit:g} mm/s" if lasts else ""
    return replace(guard, fast_since=since, too_fast=words)


def _guarded(setup: Setup, state: CoreState, speed: float) -> Guard:
    """Judge whether the real robot moves, whoever drives it, and whether it can stop before each zone."""
    last, flags, config = state.real.last, state.flags, setup.config
    driven = flags is not None and (flags.own_program or flags.streaming) and not flags.paused
    moves = driven or speed > config.separation.standstill_mm_s * 1e-3
    guard = replace(state.guard if moves else Guard(), moves=moves, violation="")
    if not setup.keep_out or speed <= 0.0 or not (moves or state.mode in LEADING):
        return guard
    delay = config.cell.braking_delay_ms * 1e-3
    earlier = state.real.history[-GAIN_SAMPLES:][0]
    dt = last.t - earlier.t
    reached = reached_speed(earlier.qdot, last.qdot, dt, delay, setup.velocity) if dt > 0.0 else last.qdot
    stop = braking_way(last.q, last.qdot, setup.braking, delay, reached)
    return replace(guard, violation=heads_into(setup.points, setup.keep_out, last.q, stop))


def cap_speed(setup: Setup, state: CoreState, now: float) -> tuple[CoreState, list[AnyAction]]:
    """Keep the speed caps in force, and say what was requested, what is applied, and why."""
    motion, flags = state.motion, state.flags
    state, actions = _cap_real(setup, state, now)
    if motion is None or not state.twin.connected:
        return state, actions
    cap, reason = _twin_cap(setup, state)
    real_leads = state.leader == "real" and flags is not None
    requested = (
        flags.speed_percent if real_leads and flags else max(motion.speed_requested_percent, _measured_percent(setup, state))
    )
    applied = requested if real_leads else min(requested, cap)
    limited = requested > applied + 0.01
    if real_leads and state.speed.override_before is not None:
        applied, limited = min(requested, state.speed.override_sent), True
        requested = max(requested, state.speed.override_before)
        reason = real_cap(setup, state)[1]
    speed = state.speed if state.stream is not None else replace(state.speed, gate="")
    if speed.gate and not limited:
        limited, reason = True, speed.gate
    step = min(CAP_STEP, CAP_SHARE * cap)
    waits = speed.cap_sent is not None and now - speed.cap_sent <= RESEND_S and cap > speed.cap_percent - step
    if abs(motion.speed_limit_percent - cap) > step and not waits:
        actions = [*actions, CapTwin(cap)]
        speed = replace(speed, cap_sent=now, cap_percent=cap)
    new = replace(speed, requested=requested, applied=applied, limited=limited, reason=reason if limited else "")
    return (state if new == state.speed else replace(state, speed=new)), actions


def _twin_cap(setup: Setup, state: CoreState) -> tuple[float, str]:
    """Return the lowest cap of the twin's program speed [percent] and where it comes from."""
    limit, cell = setup.config.limit, setup.config.cell
    caps = [(state.speed.cap, "the operator's SPEED")]
    if state.real.connected and state.flags is not None:
        override = max(state.flags.override_percent, 1.0)
        room = override / limit.override_margin
        caps += [
            (limit.speed_percent, f"above {limit.speed_percent:g} % the real robot gets that much"),
            (room, f"the real robot's override is {override:g} %, and it needs some of that to keep up"),
        ]
    if cell.cartesian_speed_mm_s is not None:
        own = speed_cap(state.way.peak_speed, cell.cartesian_speed_mm_s) if state.way.target else setup.safe_percent
        caps.append((own, _cartesian(setup)))
    caps.append((state.separation.cap, state.separation.reason))
    cap, reason = min(caps, key=lambda entry: entry[0])
    return max(cap, 1.0), reason


def _measured_percent(setup: Setup, state: CoreState) -> float:
    """Return the twin's measured speed [percent of the joints' largest] while it leads; it is believed over the claimed one."""
    if state.leader not in ("twin", "operator") or not state.twin.history:
        return 0.0
    return 100.0 * max(abs(v) / limit for v, limit in zip(state.twin.last.qdot, setup.velocity))


def _cartesian(setup: Setup) -> str:
    return f"no watched point may exceed {setup.config.cell.cartesian_speed_mm_s:g} mm/s"


def real_cap(setup: Setup, state: CoreState) -> tuple[float, str]:
    """Return the largest override that the real robot may have [percent] and why."""
    caps = [(state.speed.cap, "the operator's SPEED")]
    if setup.config.cell.cartesian_speed_mm_s is not None:
        caps.append((setup.safe_percent, _cartesian(setup)))
    if state.leader == "real":
        caps.append((state.separation.cap, state.separation.reason))
    cap, reason = min(caps, key=lambda entry: entry[0])
    return float(max(1, int(cap))), reason


def _cap_real(setup: Setup, state: CoreState, now: float) -> tuple[CoreState, list[AnyAction]]:
    """Lower the robot's override at once as far as its limits ask, before it moves too, and give it back afterwards."""
    speed, flags = state.speed, state.flags
    if flags is None:
        return state, []
    allowed, before, shown = real_cap(setup, state)[0], speed.override_before, flags.override_percent
    waits = now - speed.override_at < RESEND_S
    if allowed < shown - CAP_STEP:
        if waits and allowed >= speed.override_sent:
            return state, []
        own = speed.override_sent if waits else shown
        wanted, before = allowed, own if before is None else before
    elif waits:
        return state, []
    elif before is not None and abs(shown - speed.override_sent) < CAP_STEP:
        wanted = min(before, allowed)
        if wanted < min(before, shown + RAISE_STEP):
            return state, []
    else:
        return (replace(state, speed=replace(speed, override_before=None)) if before is not None else state), []
    if abs(wanted - shown) < CAP_STEP:
        return state, []
    kept = None if wanted >= before else before
    return _override(state, wanted, kept, now)


def _override(state: CoreState, wanted: float, own: float | None, now: float) -> tuple[CoreState, list[AnyAction]]:
    """Send an override and remember the robot's own."""
    speed = replace(state.speed, override_before=own, override_sent=wanted, override_at=now)
    return replace(state, speed=speed), [OverrideReal(wanted)]


def set_speed(setup: Setup, state: CoreState, percent: float, now: float) -> tuple[CoreState, list[AnyAction], str]:
    """Take the operator's SPEED: the cap of both sides, and the real robot's own override as far as its limits allow.

    Returns:
        The state after, the actions, and the answer.
    """
    state = replace(state, speed=replace(state.speed, cap=percent))
    answer = f"speed of both capped at {percent:g} %"
    if state.flags is None:
        return state, [], f"{answer}; the real robot is not reached: its override is lowered to that once it is, but not raised"
    allowed, reason = real_cap(setup, state)
    wanted = min(percent, allowed)
    held = wanted < percent - 1.0 + 1e-6
    state, actions = _override(state, wanted, percent if held else None, now)
    return state, actions, f"{answer}; the real robot gets {wanted:g} % for now: {reason}" if held else answer
