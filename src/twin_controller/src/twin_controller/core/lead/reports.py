"""What the two sides report of themselves: stops, pauses, faults, programs.

A report may be older than our last command; a side that was stopped on its own is told apart from
one that obeys us.
"""

from __future__ import annotations

import msgspec
from scara_config.stopping import stops_command

from twin_controller.core.actions import AnyAction
from twin_controller.core.events import AnyEvent, MoveEnded, RealMeasured, TwinMotion
from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.lead.repeated import count
from twin_controller.core.lead.standing import (
    moved_since,
    moves_in_stop,
    real_stands,
    unshown,
)
from twin_controller.core.lead.state import Lead, record_notice
from twin_controller.core.lead.table import FOLLOWS_TWIN, LEADING
from twin_controller.core.orders.order import due
from twin_controller.core.orders.speed import Speeds, hear_override
from twin_controller.core.orders.state import OWN_COMMAND, held_there, is_old, pauses
from twin_controller.core.orders.stop import StopOrder, estop_missed, moves_on, under_way
from twin_controller.core.orders.stream import AUTO, StreamOrder, by_hand
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change
from twin_controller.core.sides.measure import agree_at_rest
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace


def note_ended(setup: Setup, lead: Lead, event: AnyEvent) -> tuple[Lead, list[AnyAction]]:
    """Note that the operator's move or the robot's own program has ended.

    Where a newer move has begun, what ended the older one was said.

    Args:
        setup: Profile and numbers.
        lead: The lead before.
        event: The input.

    Returns:
        The lead after; the decision MOVE_FAILED if an accepted move did not reach its target.
    """
    match event:
        case MoveEnded() if event.number in (0, lead.move):
            return _move_ended(lead, event, setup.config.decision_history)
        case RealMeasured():
            repeated = count(lead.repeated, event, setup.writes)
            was_off = lead.program_was_off or repeated.is_off
            if repeated is not lead.repeated or was_off is not lead.program_was_off:
                lead = replace(lead, repeated=repeated, program_was_off=was_off)
    return lead, []


def note_in_zone(
    setup: Setup, lead: Lead, before: str, inside: str, now: float
) -> tuple[Lead, list[AnyAction]]:
    """Say that the real robot was stopped too late before a zone, and what to measure.

    Args:
        setup: Profile and numbers.
        lead: The lead before.
        before: How deep it stood in a zone before, in words.
        inside: How deep it stands now.
        now: Time [s].

    Returns:
        The lead after; the decision IN_ZONE if it stands in a zone from now on.
    """
    if not inside or before:
        return lead, []
    late = f"it brakes later than {1e3 * setup.braking_delay:g} ms, the profile's braking_delay_ms"
    why = f"{inside}: {late}: {stops_command(setup.robot.name)} measures it"
    lead = replace(lead, why=why)
    lead, decision = record_notice(lead, "IN_ZONE", why, (), setup.config.decision_history, now)
    return lead, [decision]


def note_operation_mode(setup: Setup, lead: Lead, event: AnyEvent) -> tuple[Lead, list[AnyAction]]:
    """Say that somebody has turned the mode switch at the real robot.

    Args:
        setup: Profile and numbers.
        lead: The lead before.
        event: The input.

    Returns:
        The lead after; the decision OPERATION_MODE if the switch stands elsewhere than it was last
        seen, or not at AUTO at the start.
    """
    if not isinstance(event, RealMeasured) or event.operation_mode in ("", lead.operation_mode):
        return lead, []
    lead = replace(lead, operation_mode=event.operation_mode)
    why = by_hand(event) or f"the real robot's mode switch is at {AUTO}: it can be led again"
    history = setup.config.decision_history
    lead, decision = record_notice(lead, "OPERATION_MODE", why, (), history, event.now)
    return lead, [decision]


def note_override(
    setup: Setup, lead: Lead, speeds: Speeds, event: AnyEvent
) -> tuple[Lead, Speeds, list[AnyAction]]:
    """Say that somebody at the real robot has changed its override.

    Nothing else follows from that here: who leads goes on, and the caps of both sides keep to it.

    Args:
        setup: Profile and numbers.
        lead: The lead before.
        speeds: What was ordered of both sides.
        event: The input.

    Returns:
        Lead and speeds after; the decision OVERRIDE if it is not we who changed it.
    """
    if not isinstance(event, RealMeasured):
        return lead, speeds, []
    speeds, was = hear_override(setup.config.speed, speeds, event)
    if was is None:
        return lead, speeds, []
    now = f"{event.override_percent:g} %, it was {was:g} %"
    why = f"the real robot's override was set to {now}, at the robot: the pair keeps to it"
    history = setup.config.decision_history
    lead, decision = record_notice(lead, "OVERRIDE", why, (), history, event.now)
    return lead, speeds, [decision]


def _move_ended(lead: Lead, event: MoveEnded, history: int) -> tuple[Lead, list[AnyAction]]:
    """Decide nothing, but say that a move that was accepted has failed, and why."""
    if event.success:
        return replace(lead, move_pending=False, move_failed=""), []
    why = f"the operator's move did not reach its target: {event.message}"
    lead = replace(lead, move_pending=False, move_failed=why)
    if lead.mode is Mode.OPERATOR_LEADS:
        # In another mode its own reason says more: it is what ended the move.
        lead = replace(lead, why=why)
    lead, decision = record_notice(lead, "MOVE_FAILED", why, (), history, event.now)
    return lead, [decision]


def note_pauses(lead: Lead, sides: Sides) -> Lead:
    """Note that a side has paused: from then on, one that moves has gone on."""
    flags, motion = sides.real.flags, sides.twin.motion
    if lead.mode is not Mode.PAUSED or flags is None or motion is None:
        return lead
    real, twin = lead.paused_seen
    seen = (real or flags.paused, twin or pauses(motion))
    return replace(lead, paused_seen=seen)


def note_stopped(lead: Lead, before: StopOrder | None, after: StopOrder | None) -> Lead:
    """Note that a stop of the robot is over: a program that runs from then on is a new one."""
    if before is None or before.given_back is None or after is not None:
        return lead
    return replace(lead, program_was_off=True)


def agree_when_stopped(setup: Setup, lead: Lead, sides: Sides, now: float) -> Sides:
    """Agree on the position of each side that has come to rest after a stop or a pause.

    Not of a robot whose program goes on, for no stop from here reaches it: where that stands for a
    moment it has not ended, and whoever moves it has not come since.
    """
    stops = lead.mode in (Mode.STOPPED, Mode.PAUSED, Mode.STANDSTILL)
    if not stops or now - lead.since < setup.config.settle.minimum_ms * 1e-3:
        return sides
    flags, real = sides.real.flags, sides.real
    goes_on = flags is not None and flags.own_program and not lead.program_was_off
    if setup.writes or not goes_on:
        real = agree_at_rest(setup, real)
    return Sides(real, agree_at_rest(setup, sides.twin))


def side_triggers(setup: Setup, state: CoreState, now: float) -> list[Trigger]:
    """Return what the two sides report, most urgent first."""
    flags, motion = state.sides.real.flags, state.sides.twin.motion
    lead, config = state.lead, setup.config
    if flags is None or motion is None:
        return [*_ended_meanwhile(state), *_estop_reports(setup, state, now)]
    if lead.mode is Mode.OFFLINE:
        return _ended_meanwhile(state)
    old = is_old(setup, state.orders.told, motion, now)
    found: list[Trigger] = []
    if not flags.drives_on:
        found.append(Trigger.REAL_DRIVES_OFF)
    elif flags.fault:
        found.append(Trigger.REAL_FAULT)
    # What the twin reports from before our last command is no news of its own side.
    if not old:
        found += _twin_reports(setup, state, motion, now)
    found += _real_reports(setup, state, flags, now)
    found += _estop_reports(setup, state, now)
    if state.safety.divergence.alarm and config.divergence.pause and lead.mode in LEADING:
        found.append(Trigger.DIVERGED)
    return found + _reset_reports(setup, state, flags, now)


def _estop_reports(setup: Setup, state: CoreState, now: float) -> list[Trigger]:
    """Return what a latched emergency stop still lacks; a side that is away is told later."""
    lead, config, found = state.lead, setup.config.estop, list[Trigger]()
    if lead.mode is not Mode.ESTOP or lead.reset_since is not None:
        return []
    flags, motion = state.sides.real.flags, state.sides.twin.motion
    off = frozen = True
    if flags is not None:
        stands = real_stands(setup, state, flags, now)
        late = now - lead.since > config.shown_ms * 1e-3
        # One that has only just been heard again has not been seen for long enough to stand.
        seen = [each.time for each in state.sides.real.history]
        known = bool(seen) and seen[-1] - seen[0] > setup.config.change.still_time_ms * 1e-3
        if late and known and not lead.helpless and not stands and setup.writes:
            found.append(Trigger.ESTOP_IGNORED)
        off = not flags.drives_on or (stands and not setup.cuts_drives) or not setup.writes
    if motion is not None:
        old = is_old(setup, state.orders.told, motion, now)
        frozen = motion.state == "estopped" or old
    if estop_missed(state.orders.estop, off and frozen, now):
        found.append(Trigger.ESTOP_MISSED)
    return found


def resume_blocked(state: CoreState) -> bool:
    """Return whether a paused motion may not go on, whoever lets it.

    A divergence is not acknowledged, a person is too close, or the robot's mode switch forbids it.
    """
    led = state.lead.paused in FOLLOWS_TWIN
    manual = led and bool(by_hand(state.sides.real.flags))
    return state.lead.needs_acknowledge or state.safety.separation.too_close or manual


def _reset_reports(
    setup: Setup, state: CoreState, flags: RealMeasured, now: float
) -> list[Trigger]:
    """Return how a reset that the operator asked for has ended."""
    lead = state.lead
    if lead.reset_since is None or lead.mode not in (Mode.ESTOP, Mode.FAULT):
        return []
    waited, config = now - lead.reset_since, setup.config.reset
    if waited >= config.wait_ms * 1e-3 and not reset_lacks(setup, state, flags, now):
        return [Trigger.RESET_DONE]
    if waited > config.timeout_ms * 1e-3:
        return [Trigger.RESET_FAILED]
    return []


def reset_lacks(setup: Setup, state: CoreState, flags: RealMeasured, now: float) -> str:
    """Return what a reset still lacks, in words; empty: nothing."""
    alarm, stop = state.sides.real.alarm, state.orders.twin_stop
    if not flags.drives_on:
        cause = "its emergency stop is pressed" if flags.estop_pressed else alarm
        return f"its drives are off: {cause}" if cause else "its drives are off"
    if flags.fault:
        return alarm or "its FAULT is on"
    # A twin that still does not obey a stop is a cause that persists.
    if stop is not None and stop.defied:
        return Trigger.TWIN_STOP_IGNORED.value
    # So is a real robot that was not stopped by the emergency stop.
    latched = state.lead.mode is Mode.ESTOP and setup.writes
    return "it moves" if latched and not real_stands(setup, state, flags, now) else ""


def moved_since_pause(setup: Setup, state: CoreState) -> bool:
    """Return whether a side of a paused pair does not stand where it came to rest.

    A robot that was not told to pause may not have come to rest at all.
    """
    defies = moves_on(state.orders.twin_stop)
    goes_on = not setup.writes and not state.sides.real.change.baseline
    moved = defies or goes_on or moved_since(setup, state.sides)
    return state.lead.mode is Mode.PAUSED and moved


def _ended_meanwhile(state: CoreState) -> list[Trigger]:
    """Return a stop or a pause that somebody gave the twin on its side while a link was away."""
    lead, motion, before = state.lead, state.sides.twin.motion, state.orders.told.before
    if lead.mode is not Mode.OFFLINE or lead.was_stopped or motion is None:
        return []
    number = motion.last_command_id
    # One that was there before our own last command is no news.
    if number & OWN_COMMAND or (before is not None and number == before.last_command_id):
        return []
    if motion.state == "stopping":
        return [Trigger.TWIN_STOPPED]
    return [Trigger.TWIN_PAUSED] if pauses(motion) else []


def _twin_reports(setup: Setup, state: CoreState, motion: TwinMotion, now: float) -> list[Trigger]:
    """Return stops, pauses and motion that came from the twin's side, not from us."""
    lead = state.lead
    if motion.state == "estopped":
        return [Trigger.TWIN_ESTOPPED]
    own = motion.last_command_id & OWN_COMMAND
    if motion.state == "stopping" and not own:
        return [Trigger.TWIN_STOPPED]
    follows = state.follow.real
    waits = follows is not None and follows.resumes
    if pauses(motion) and not (own or waits) and lead.mode in (Mode.IDLE, *LEADING):
        return [Trigger.TWIN_PAUSED]
    moves = motion.state in ("moving", "announcing")
    told_lately = now - state.orders.told.sent <= setup.config.twin.stop_quiet_ms * 1e-3
    if moves and lead.mode is Mode.REAL_LEADS and not told_lately:
        return [Trigger.TWIN_MOVES_TOO]
    by_twin = lead.paused_by is Trigger.TWIN_PAUSED
    # A twin that was paused while nothing moved goes on to nothing.
    goes_on = moves or (by_twin and lead.paused is Mode.IDLE and motion.state == "idle")
    if lead.mode is Mode.PAUSED and lead.paused_seen[1] and goes_on:
        if not by_twin or resume_blocked(state):
            return [Trigger.RELEASED_BLOCKED]
        # The robot's program is let go on once it is paused.
        return [] if unshown(state) else [Trigger.TWIN_RESUMED]
    # What its nodes report does not count: a joint may be commanded past all of them, and a move
    # may begin where there was none to be paused. A twin that was told to stand slows down first.
    rested = lead.mode is Mode.PAUSED and state.orders.twin_stop is None
    seen, config = state.sides.twin.change, setup.config.change
    if rested and change.moved(seen, config) and not change.stands_still(seen, now, config):
        return [Trigger.TWIN_MOVED_PAUSED]
    if not lead.twin_named and moves_in_stop(setup, state, now):
        return [Trigger.TWIN_MOVED_STOPPED]
    return []


def _real_reports(setup: Setup, state: CoreState, flags: RealMeasured, now: float) -> list[Trigger]:
    """Return what the real robot's program says."""
    lead, follows, real = state.lead, state.follow.real, state.sides.real
    if lead.mode is Mode.PAUSED:
        blocked = resume_blocked(state) or moves_on(state.orders.twin_stop)
        blocked = blocked or lead.paused_by is not Trigger.REAL_HELD
        return _paused_real_reports(lead, flags, blocked)
    runs = flags.own_program and not flags.paused
    # A program that ran before a stop and is still reported is not a new one.
    new = lead.program_was_off and (lead.mode is not Mode.STOPPED or lead.repeated.is_running)
    if runs and (new or lead.mode is Mode.IDLE):
        return [Trigger.REAL_TOOK_OVER]
    if lead.mode not in FOLLOWS_TWIN or follows is None or state.orders.stream is None:
        return []
    own = real.change.onset if change.moved(real.change, setup.config.change) else None
    if own is not None and follows.onset is not None and own <= follows.onset:
        return [Trigger.REAL_WAS_FIRST]
    # The stream before is told to end: this one is asked for when that is shown.
    if under_way(state.orders.stop):
        return []
    held = held_there(setup.config.stop, state.orders, flags)
    return _stream_reports(state.orders.stream, flags, held, now)


def _stream_reports(
    stream: StreamOrder, flags: RealMeasured, held: bool, now: float
) -> list[Trigger]:
    """Return what has become of the robot's stream program."""
    start = stream.start
    if stream.loaded and not flags.streaming:
        return [Trigger.REAL_STOPPED]
    if flags.paused:
        # A program that has never run may still be paused from before: it gets its time to go on.
        # Where somebody holds the robot there is none.
        if start.shown or held or due([start], now).failures:
            return [Trigger.REAL_HELD]
        return []
    if flags.streaming:
        return []
    if start.shown:
        return [Trigger.REAL_STOPPED]
    return [Trigger.STREAM_FAILED] if due([start], now).failures else []


def _paused_real_reports(lead: Lead, flags: RealMeasured, blocked: bool) -> list[Trigger]:
    """Return whether a paused robot goes on, was stopped, or has begun a program of its own."""
    if flags.paused:
        return []
    if lead.paused_seen[0]:
        if not flags.loaded:
            return [Trigger.REAL_STOPPED]
        if not lead.repeated.is_running:
            return []
        return [Trigger.RELEASED_BLOCKED if blocked else Trigger.REAL_RELEASED]
    own = flags.own_program and lead.program_was_off and lead.paused in FOLLOWS_TWIN
    return [Trigger.REAL_TOOK_OVER] if own else []
