"""What is shown of the core's state: topic fields, diagnostics and decisions in words; pure."""

from __future__ import annotations

import math

from scara_control.kinematics.screws import Point
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.message_struct import struct_of

from scara_msgs.msg import LinkState, TwinControllerState
from twin_controller.config import TwinControllerConfig
from twin_controller.core.actions import Decided
from twin_controller.core.control import NOBODY, others_text
from twin_controller.core.follow.ahead import reaches_ahead
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.standing import real_stands
from twin_controller.core.lead.table import LEADING
from twin_controller.core.orders.gripper import gripper_text
from twin_controller.core.safety.divergence import tools
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change
from twin_controller.core.sides.pairing import SidesAtOnce, deviation, paired
from twin_controller.core.sides.side import Side
from twin_controller.core.state import CoreState

NOWHERE: Point = (math.nan, math.nan, math.nan)
"""Where a tool is that is not known at the same instant as the other one."""


class LinkView(struct_of(LinkState, "rejected", "repeated", "reconnects")):  # type: ignore[misc]
    """The fields of scara_msgs/LinkState that the core knows."""


class StateView(struct_of(TwinControllerState)):  # type: ignore[misc]
    """The fields of scara_msgs/TwinControllerState; what is refused is filled in later."""

    real_tool: Point = NOWHERE
    twin_tool: Point = NOWHERE
    # On the controller's clock [s].
    held_since: float = 0.0
    links: tuple[LinkView, ...] = ()


def state_view(
    setup: Setup, state: CoreState, now: float, pair: SidesAtOnce | None = None
) -> StateView:
    """Return what ``twin_controller/state`` shows.

    Both sides are shown at the same instant, so that all that is shown of them agrees. Positions
    are rounded as the article does, and empty while unknown.

    Args:
        setup: Profile and numbers.
        state: Of the core.
        now: Monotonic [s].
        pair: Both sides at the instant to show; None: at the newest at which both are known.
    """
    sides, lead, speeds = state.sides, state.lead, state.orders.speeds
    pair = pair or paired(sides)
    # The newest sample of each side that has one, where nobody knows both at one instant.
    shown = pair or [side.last if side.history else None for side in (sides.real, sides.twin)]
    decimals, late = setup.config.change.decimals, state.safety.delay.late
    real, twin = (
        tuple(round(q, decimals) for q in setup.to_border(motion.q)) if motion else ()
        for motion in shown
    )
    real_tool, twin_tool = tools(setup, pair) if pair else (NOWHERE, NOWHERE)
    control = lead.control
    left = control.asked + setup.config.control.answer_ms * 1e-3 - now
    return StateView(
        mode=lead.mode.value,
        leader=lead.leader,
        why=lead.why,
        name=setup.names,
        unit=tuple(joint.unit for joint in setup.joints),
        real_position=real,
        twin_position=twin,
        deviation=tuple(round(a - b, decimals) for a, b in zip(real, twin)),
        speed_requested_percent=math.nan if speeds.requested is None else speeds.requested,
        speed_applied_percent=math.nan if speeds.applied is None else speeds.applied,
        speed_limited=speeds.limited,
        speed_reason=speeds.reason,
        real_override_percent=0.0
        if sides.real.flags is None
        else sides.real.flags.override_percent,
        real_tool=real_tool,
        twin_tool=twin_tool,
        deviation_mm=1e3 * math.dist(real_tool, twin_tool),
        path_deviation_mm=state.safety.divergence.distance_mm,
        # How late the follower is on its way; NaN while nobody leads.
        lag={"real": -late, "twin": late, "operator": late}.get(lead.leader, math.nan),
        follower_lag=state.follow.response.longest,
        setpoints_ahead=reaches_ahead(setup, sides.real),
        diverged=state.safety.divergence.alarm,
        real_standing_still=change.stands_still(sides.real.change, now, setup.config.change),
        twin_standing_still=change.stands_still(sides.twin.change, now, setup.config.change),
        only_followed=setup.only_followed,
        alarm=alarm_text(setup, state, now),
        real_gripper=gripper_text(sides.real.gripper),
        twin_gripper=gripper_text(sides.twin.gripper),
        move_failed=lead.move_failed,
        gripper_alarm=state.orders.grips.trouble,
        holder=control.holder.name,
        held_since=control.since,
        holder_moves=control.moves,
        asker=control.asker.name,
        answer_left=0.0 if control.asker == NOBODY else max(0.0, left),
        not_in_control=others_text(control),
        links=(_link_view("real", sides.real, now), _link_view("twin", sides.twin, now)),
    )


def alarm_text(setup: Setup, state: CoreState, now: float) -> str:
    """Return the active alarm with what to do, or an empty text."""
    sides, lead, flags = state.sides, state.lead, state.sides.real.flags
    if sides.real.alarm and sides.real.history:
        return sides.real.alarm
    if lead.helpless and (flags is None or not real_stands(setup, state, flags, now)):
        return "the real robot moves on: press the emergency stop at the robot itself"
    if lead.mode is Mode.ESTOP:
        return "emergency stop is latched: remove the cause, RESET, then ALIGN"
    if lead.mode is Mode.FAULT:
        return lead.why
    if lead.needs_acknowledge:
        return (
            "the pair came apart: look at both robots, ACKNOWLEDGE, then RESUME; "
            "if they part again, STOP and ALIGN"
        )
    if lead.mode is Mode.OFFLINE:
        # One that came back after its data could not be used still has the reason of then.
        twin_is_well = sides.twin.usable and sides.twin.motion is not None
        both = (("real", sides.real, sides.real.usable), ("twin", sides.twin, twin_is_well))
        down = [f"{name}: {side.reason}" for name, side, well in both if side.reason and not well]
        if not down and state.safety.separation.silent:
            return f"the pair waits to align: {state.safety.separation.reason}"
        return "; ".join(down)
    return state.orders.grips.trouble


def delay_text(state: CoreState) -> str:
    """Say who is behind, by how much time and how far; empty if nobody is, or nobody compares."""
    delay = state.safety.delay
    # Nobody compares the tools in other modes: an alarm from before would go on until ALIGN.
    if not delay.judged.alarm or state.lead.mode not in (Mode.IDLE, *LEADING):
        return ""
    behind, ahead = "real robot", "twin"
    if state.lead.leader == "real":
        behind, ahead = ahead, behind
    apart = f"their tools are {delay.judged.distance_mm:.0f} mm apart at the same instant"
    return f"the {behind} is {1e3 * abs(delay.late):.0f} ms behind the {ahead}: {apart}"


def decision_text(decision: Decided) -> str:
    """Return one decision as a line for a person."""
    modes = f"{decision.mode_before} -> {decision.mode_after}"
    by = f" [by {decision.who}]" if decision.who else ""
    line = f"#{decision.seq} {decision.now:.3f} s {modes}: {decision.why}{by}"
    if decision.onset_real is None and decision.onset_twin is None:
        return line
    shown = [
        f"{side} moved at {onset:.4f} s" if onset is not None else f"{side} did not move"
        for side, onset in (("real", decision.onset_real), ("twin", decision.onset_twin))
    ]
    if decision.onset_real is not None and decision.onset_twin is not None:
        shown.append(f"difference {(decision.onset_twin - decision.onset_real) * 1e3:+.1f} ms")
    return f"{line} ({', '.join(shown)}, uncertainty {decision.onset_uncertainty * 1e3:.1f} ms)"


def statuses(
    setup: Setup, state: CoreState, counters: dict[str, dict[str, int]], now: float
) -> list[Diagnosis]:
    """Return the diagnostics of the controller, its links, the robot, who may lead, the pair."""
    view = state_view(setup, state, now)
    grips, real, safety = state.orders.grips, state.sides.real, state.safety
    late = delay_text(state)
    mode_level = {
        Mode.ESTOP: Level.ERROR,
        Mode.FAULT: Level.ERROR,
        Mode.OFFLINE: Level.ERROR,
        Mode.STOPPED: Level.WARN,
        Mode.STANDSTILL: Level.WARN,
        Mode.PAUSED: Level.WARN,
    }.get(state.lead.mode, Level.OK)
    robot_level = Level.ERROR if real.alarm else Level.WARN if real.warning else Level.OK
    leading = "either side may lead"
    if setup.only_followed:
        leading = f"the robot is followed, and never led: {setup.only_followed}"
    return [
        Diagnosis(
            mode_level,
            "twin_controller: mode",
            f"{view.mode}: {view.alarm or view.why}",
            {"leader": view.leader, "why": view.why, "speed_reason": view.speed_reason},
        ),
        *(_link_status(link, counters.get(link.name, {})) for link in view.links),
        Diagnosis(
            Level.WARN if grips.trouble else Level.OK,
            "twin_controller: grippers",
            grips.trouble or "agree",
            {"real": view.real_gripper, "twin": view.twin_gripper},
        ),
        Diagnosis(
            robot_level,
            "twin_controller: real robot",
            real.alarm or real.warning or "no alarm",
        ),
        Diagnosis(
            Level.WARN if setup.only_followed else Level.OK, "twin_controller: leading", leading
        ),
        Diagnosis(
            Level.ERROR if view.diverged else Level.OK,
            "twin_controller: pair",
            "the pair came apart" if view.diverged else "together",
            {
                "deviation_mm": f"{view.deviation_mm:.3f}",
                "path_deviation_mm": f"{view.path_deviation_mm:.3f}",
                "joint_deviation": f"{deviation(setup, state.sides):.3f}",
            },
        ),
        Diagnosis(
            Level.WARN if late else Level.OK,
            "twin_controller: delay",
            late or "both at the same place at the same time",
            {
                "apart_mm": f"{safety.delay.judged.distance_mm:.3f}",
                "follower_delay_ms": f"{1e3 * view.follower_lag:.1f}",
                "setpoints_ahead_ms": f"{1e3 * view.setpoints_ahead:.0f}",
                # How often the real robot had no set point ahead left, as it counts.
                "setpoints_underruns": str(real.flags.ring_underruns if real.flags else 0),
            },
        ),
    ]


def _link_status(link: LinkView, counters: dict[str, int]) -> Diagnosis:
    """Return the diagnostic of a link, with what its connection has counted."""
    return Diagnosis(
        Level.OK if link.connected and not link.reason else Level.ERROR,
        f"twin_controller: link {link.name}",
        link.reason or "connected",
        {
            "age_ms": f"{link.age * 1e3:.1f}",
            "round_trip_ms": f"{link.round_trip * 1e3:.2f}",
            "clock_offset_s": f"{link.clock_offset:.4f}",
            "clock_uncertainty_ms": f"{link.clock_uncertainty * 1e3:.2f}",
            "clock_drift_ppm": f"{link.clock_drift_ppm:.0f}",
            **{key: str(value) for key, value in counters.items()},
        },
    )


def _link_view(name: str, side: Side, now: float) -> LinkView:
    age = now - side.last.time if side.history else float("inf")
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


def links_text(config: TwinControllerConfig) -> str:
    """Say which link limits are in force, for the log."""
    return (
        f"link limits: {config.links}; robot: answer {config.real.timeout_ms:g} ms,"
        f" data {config.real.stale_ms:g} ms; twin: data {config.twin.stale_ms:g} ms"
    )
