"""Watch over the pair: divergence of the tools, and the cap on the twin's speed."""

from __future__ import annotations

import msgspec
import numpy as np
from scara_control.screws import tool_positions

from twin_controller.core.actions import AnyAction, CapTwin
from twin_controller.core.observing import change
from twin_controller.core.observing.divergence import judge, path_distance
from twin_controller.core.state import CoreState, Setup
from twin_controller.core.table import LEADING, Mode

replace = msgspec.structs.replace


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


def cap_speed(setup: Setup, state: CoreState, now: float) -> tuple[CoreState, list[AnyAction]]:
    """Keep the twin's speed cap in force, and say what was requested, what is applied, and why."""
    motion, flags, speed = state.motion, state.flags, state.speed
    if motion is None or not state.twin.connected:
        return state, []
    cap, reason = speed.cap, "the operator's SPEED"
    if state.real.connected and flags is not None:
        for limit, why in (
            (setup.config.limit.speed_percent, f"above {setup.config.limit.speed_percent:g} % the real robot gets that much"),
            (max(flags.override_percent, 1.0), f"the real robot's override is {flags.override_percent:g} %"),
        ):
            if limit < cap:
                cap, reason = limit, why
    real_leads = state.leader == "real" and flags is not None
    requested = flags.speed_percent if real_leads and flags else motion.speed_requested_percent
    applied = requested if real_leads else min(requested, cap)
    limited = requested > applied + 0.01
    actions: list[AnyAction] = []
    if abs(motion.speed_limit_percent - cap) > 0.01 and (speed.cap_sent is None or now - speed.cap_sent > 0.2):
        actions.append(CapTwin(cap))
        speed = replace(speed, cap_sent=now)
    new = replace(speed, requested=requested, applied=applied, limited=limited, reason=reason if limited else "")
    return (state if new == state.speed else replace(state, speed=new)), actions
