"""What the two sides report of themselves: stops, pauses, faults, programs. A report may be older than our last command."""

from __future__ import annotations

from twin_controller.core.events import RealMeasured, TwinMotion
from twin_controller.core.observing import change
from twin_controller.core.rules.table import LEADING, Mode, Trigger
from twin_controller.core.state import CoreState, Setup

OWN_COMMAND = 1 << 30
"""Set in the id of each of our commands to the twin, which reports the last one it obeyed."""

ESTOP_REPEAT_S = 0.5
"""A side that does not obey a latched emergency stop is told again after this time [s]."""

FOLLOWS_TWIN = (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)


def side_triggers(setup: Setup, state: CoreState, now: float) -> list[Trigger]:
    """Return what the two sides report, most urgent first."""
    flags, motion = state.flags, state.motion
    if flags is None or motion is None or state.mode is Mode.OFFLINE:
        return []
    found: list[Trigger] = []
    if not flags.drives_on:
        found.append(Trigger.REAL_DRIVES_OFF)
    elif flags.fault:
        found.append(Trigger.REAL_FAULT)
    found += _twin_reports(setup, state, motion, now)
    found += _real_reports(setup, state, flags, now)
    if _estop_missed(setup, state, flags, motion, now):
        found.append(Trigger.ESTOP_MISSED)
    if state.divergence.alarm and setup.config.divergence.pause and state.mode in LEADING:
        found.append(Trigger.DIVERGED)
    return found + _reset_reports(setup, state, flags, now)


def _estop_missed(setup: Setup, state: CoreState, flags: RealMeasured, motion: TwinMotion, now: float) -> bool:
    """Return whether a side does not obey a latched emergency stop: it was not reached then, or was let go on its side."""
    if state.mode is not Mode.ESTOP or state.reset_since is not None or now - state.estop_at < ESTOP_REPEAT_S:
        return False
    return flags.drives_on or (motion.state != "estopped" and not _is_old(setup, state, motion, now))


def _reset_reports(setup: Setup, state: CoreState, flags: RealMeasured, now: float) -> list[Trigger]:
    """Return how a reset that the operator asked for has ended."""
    if state.reset_since is None or state.mode not in (Mode.ESTOP, Mode.FAULT):
        return []
    waited, config = now - state.reset_since, setup.config.reset
    if flags.drives_on and not flags.fault and waited >= config.wait_ms * 1e-3:
        return [Trigger.RESET_DONE]
    return [Trigger.RESET_FAILED] if waited > config.timeout_ms * 1e-3 else []


def _twin_reports(setup: Setup, state: CoreState, motion: TwinMotion, now: float) -> list[Trigger]:
    """Return stops and pauses that came from the twin's side, not from us."""
    if _is_old(setup, state, motion, now):
        return []
    if motion.state == "estopped":
        return [Trigger.TWIN_ESTOPPED]
    own = motion.last_command_id & OWN_COMMAND
    if motion.state == "stopping" and not own:
        return [Trigger.TWIN_STOPPED]
    if _pauses(motion) and not own and state.mode in LEADING:
        return [Trigger.TWIN_PAUSED]
    if state.mode is Mode.PAUSED and state.paused_seen[1] and motion.state in ("moving", "announcing"):
        return [Trigger.RELEASED_BLOCKED if state.resume_blocked else Trigger.TWIN_RESUMED]
    return []


def _is_old(setup: Setup, state: CoreState, motion: TwinMotion, now: float) -> bool:
    """Return whether the twin still reports what it did when our last command was sent; that command is on its way then."""
    asked = state.asked
    if asked is None or now - state.asked_at > setup.config.twin.stop_quiet_ms * 1e-3:
        return False
    same = motion.state == asked.state or (_pauses(motion) and _pauses(asked))
    return same and motion.last_command_id == asked.last_command_id


def _pauses(motion: TwinMotion) -> bool:
    return motion.state in ("pausing", "paused")


def _real_reports(setup: Setup, state: CoreState, flags: RealMeasured, now: float) -> list[Trigger]:
    """Return what the real robot's program says."""
    if state.mode is Mode.PAUSED:
        return _paused_real_reports(state, flags)
    if flags.own_program and not flags.paused and (state.program_was_off or state.mode is Mode.IDLE):
        return [Trigger.REAL_TOOK_OVER]
    if state.mode not in FOLLOWS_TWIN or state.stream is None:
        return []
    own = state.real.change.onset if change.moved(state.real.change, setup.config.change) else None
    if own is not None and state.stream.onset is not None and own <= state.stream.onset:
        return [Trigger.REAL_WAS_FIRST]
    return _stream_reports(setup, state, flags, now)


def _stream_reports(setup: Setup, state: CoreState, flags: RealMeasured, now: float) -> list[Trigger]:
    """Return what has become of the robot's stream program."""
    stream, config = state.stream, setup.config.stream
    assert stream is not None
    waited = now - stream.started
    if flags.paused:
        return [Trigger.REAL_HELD] if stream.seen or waited > config.attempts * config.retry_ms * 1e-3 else []
    if flags.streaming:
        return []
    if stream.seen or stream.loaded:
        return [Trigger.REAL_STOPPED]
    return [Trigger.STREAM_FAILED] if waited > config.retry_ms * 1e-3 and stream.attempts >= config.attempts else []


def _paused_real_reports(state: CoreState, flags: RealMeasured) -> list[Trigger]:
    """Return whether a paused robot goes on, was stopped, or has begun a program of its own."""
    if flags.paused:
        return []
    if state.paused_seen[0]:
        if not (flags.own_program or flags.streaming):
            return [Trigger.REAL_STOPPED]
        return [Trigger.RELEASED_BLOCKED if state.resume_blocked else Trigger.REAL_RELEASED]
    own = flags.own_program and state.program_was_off and state.paused_mode in FOLLOWS_TWIN
    return [Trigger.REAL_TOOK_OVER] if own else []
