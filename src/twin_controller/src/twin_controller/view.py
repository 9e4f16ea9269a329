"""What is shown of the core's state: topic fields, diagnostics and decisions in words; pure."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import Decided
from twin_controller.core.following.follow import deviation
from twin_controller.core.gripping import gripper_text
from twin_controller.core.observing import change
from twin_controller.core.rules.table import Mode
from twin_controller.core.state import CoreState, Setup, Side

OK, WARN, ERROR, STALE = 0, 1, 2, 3


class LinkView(msgspec.Struct, frozen=True):
    """Fields of scara_msgs/LinkState that the core knows."""

    name: str
    connected: bool
    reason: str
    age: float
    round_trip: float
    clock_offset: float
    clock_uncertainty: float
    clock_drift_ppm: float
    samples: int


class StateView(msgspec.Struct, frozen=True):
    """Fields of scara_msgs/TwinControllerState that the core knows."""

    mode: str
    leader: str
    why: str
    name: list[str]
    unit: list[str]
    real_position: list[float]
    twin_position: list[float]
    deviation: list[float]
    speed_requested_percent: float
    speed_applied_percent: float
    speed_limited: bool
    speed_reason: str
    deviation_mm: float
    follower_lag: float
    diverged: bool
    real_standing_still: bool
    twin_standing_still: bool
    alarm: str
    real_gripper: str
    twin_gripper: str
    gripper_alarm: str
    links: list[LinkView]


class Status(msgspec.Struct, frozen=True):
    """One diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    values: dict[str, str]


def state_view(setup: Setup, state: CoreState, now: float) -> StateView:
    """Return what ``twin_controller/state`` shows; positions rounded as the article does, empty while unknown."""
    real, twin = _rounded(setup, state.real), _rounded(setup, state.twin)
    decimals = setup.config.change.decimals
    return StateView(
        mode=state.mode.value,
        leader=state.leader,
        why=state.why,
        name=list(setup.names),
        unit=[joint.unit for joint in setup.joints],
        real_position=real,
        twin_position=twin,
        deviation=[round(a - b, decimals) for a, b in zip(real, twin)],
        speed_requested_percent=state.speed.requested,
        speed_applied_percent=state.speed.applied,
        speed_limited=state.speed.limited,
        speed_reason=state.speed.reason,
        deviation_mm=state.divergence.distance_mm,
        follower_lag=state.lag,
        diverged=state.divergence.alarm,
        real_standing_still=change.stands_still(state.real.change, now, setup.config.change),
        twin_standing_still=change.stands_still(state.twin.change, now, setup.config.change),
        alarm=alarm_text(state),
        real_gripper=gripper_text(state.grip_real),
        twin_gripper=gripper_text(state.grip_twin),
        gripper_alarm=state.grip_trouble,
        links=[_link_view("real", state.real, now), _link_view("twin", state.twin, now)],
    )


def alarm_text(state: CoreState) -> str:
    """Return the active alarm with what to do, or an empty text."""
    if state.alarm:
        return state.alarm
    if state.mode is Mode.ESTOP:
        return "emergency stop is latched: remove the cause, RESET, then ALIGN"
    if state.mode is Mode.FAULT:
        return f"{state.why}"
    if state.needs_acknowledge:
        return "the pair came apart: look at both robots, ACKNOWLEDGE, then RESUME or STOP"
    if state.mode is Mode.OFFLINE:
        down = [f"{name}: {side.reason}" for name, side in (("real", state.real), ("twin", state.twin)) if side.reason]
        return "; ".join(down)
    return state.grip_trouble


def decision_text(decision: Decided) -> str:
    """Return one decision as a line for a person."""
    line = f"#{decision.seq} {decision.now:.3f} s {decision.mode_before} -> {decision.mode_after}: {decision.why}"
    if decision.onset_real is None and decision.onset_twin is None:
        return line
    shown = [
        f"{side} moved at {onset:.4f} s" if onset is not None else f"{side} did not move"
        for side, onset in (("real", decision.onset_real), ("twin", decision.onset_twin))
    ]
    if decision.onset_real is not None and decision.onset_twin is not None:
        shown.append(f"difference {(decision.onset_twin - decision.onset_real) * 1e3:+.1f} ms")
    return f"{line} ({', '.join(shown)}, uncertainty {decision.onset_uncertainty * 1e3:.1f} ms)"


def statuses(setup: Setup, state: CoreState, counters: dict[str, dict[str, int]], now: float) -> list[Status]:
    """Return the diagnostics of the controller, its two links, the real robot and the pair."""
    view = state_view(setup, state, now)
    level = {Mode.ESTOP: ERROR, Mode.FAULT: ERROR, Mode.OFFLINE: ERROR, Mode.STOPPED: WARN, Mode.PAUSED: WARN}
    found = [
        Status(
            level.get(state.mode, OK),
            "twin_controller: mode",
            f"{view.mode}: {view.alarm or view.why}",
            {"leader": view.leader, "why": view.why, "speed_reason": view.speed_reason},
        )
    ]
    for link in view.links:
        values = {
            "age_ms": f"{link.age * 1e3:.1f}",
            "round_trip_ms": f"{link.round_trip * 1e3:.2f}",
            "clock_offset_s": f"{link.clock_offset:.4f}",
            "clock_uncertainty_ms": f"{link.clock_uncertainty * 1e3:.2f}",
            "clock_drift_ppm": f"{link.clock_drift_ppm:.0f}",
        } | {key: str(value) for key, value in counters.get(link.name, {}).items()}
        good = link.connected and not link.reason
        found.append(Status(OK if good else ERROR, f"twin_controller: link {link.name}", link.reason or "connected", values))
    grippers = {"real": view.real_gripper, "twin": view.twin_gripper}
    found.append(Status(WARN if state.grip_trouble else OK, "twin_controller: grippers", state.grip_trouble or "agree", grippers))
    found.append(Status(ERROR if state.alarm else OK, "twin_controller: real robot", state.alarm or "no alarm", {}))
    found.append(
        Status(
            ERROR if state.divergence.alarm else OK,
            "twin_controller: pair",
            "the pair came apart" if state.divergence.alarm else "together",
            {"deviation_mm": f"{view.deviation_mm:.3f}", "joint_deviation": f"{deviation(setup, state):.3f}"},
        )
    )
    return found


def _rounded(setup: Setup, side: Side) -> list[float]:
    if not side.history:
        return []
    return [round(value, setup.config.change.decimals) for value in setup.to_border(side.last.q)]


def _link_view(name: str, side: Side, now: float) -> LinkView:
    age = now - side.last.t if side.history else float("inf")
    return LinkView(
        name=name,
        connected=side.connected and bool(side.history),
        reason=side.reason if not side.history else "",
        age=age,
        round_trip=side.clock.round_trip,
        clock_offset=side.clock.offset,
        clock_uncertainty=side.clock.uncertainty,
        clock_drift_ppm=side.clock.drift_ppm,
        samples=side.clock.samples,
    )
