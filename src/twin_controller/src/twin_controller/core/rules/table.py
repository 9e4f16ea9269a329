"""The state machine as a table: (mode, trigger) -> (next mode, actions, why).

Every pair has a row: ``DEFAULTS`` says what a trigger does unless ``ROWS`` says otherwise for a mode. Conditions are
part of the trigger (``MOVE`` or ``MOVE_UNALIGNED``), so that a row never decides anything.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec

from twin_controller.core.actions import Do


class Mode(StrEnum):
    """Mode of the twin controller."""

    OFFLINE = "OFFLINE"
    ALIGNING = "ALIGNING"
    IDLE = "IDLE"
    REAL_LEADS = "REAL_LEADS"
    TWIN_LEADS = "TWIN_LEADS"
    OPERATOR_LEADS = "OPERATOR_LEADS"
    PAUSED = "PAUSED"
    STOPPED = "STOPPED"
    ESTOP = "ESTOP"
    FAULT = "FAULT"


class Trigger(StrEnum):
    """What can happen, conditions included. The value is the wording of ``why``."""

    LINK_LOST = "a link was lost"
    LINKS_READY = "both links are up and fresh"
    ALIGNED = "the twin reached the real robot's pose"
    ALIGN_FAILED = "the twin did not reach the real robot's pose in time"
    REAL_MOVED = "the real robot moved first"
    REAL_TOOK_OVER = "the real robot moves on its own"
    REAL_WAS_FIRST = "the real robot had moved before the twin"
    TWIN_MOVED = "the twin moved first"
    TWIN_MOVED_UNALIGNED = "the twin moved while it was not aligned"
    AT_REST = "both stand still and agree"
    UNSETTLED = "both stand still but do not agree"
    REAL_FAULT = "the real robot reports an alarm that stops it"
    REAL_DRIVES_OFF = "the real robot's drives are off"
    REAL_HELD = "the real robot was held on its side"
    REAL_RELEASED = "the real robot goes on"
    REAL_STOPPED = "the real robot's program was ended on its side"
    TWIN_STOPPED = "the twin was stopped on its side"
    TWIN_PAUSED = "the twin was paused on its side"
    TWIN_RESUMED = "the twin goes on"
    TWIN_ESTOPPED = "the twin was frozen on its side"
    ESTOP_MISSED = "a side does not obey the latched emergency stop"
    STOP_IGNORED = "the real robot does not obey a stop"
    RELEASED_BLOCKED = "a side goes on while RESUME is blocked"
    STREAM_FAILED = "the real robot does not start its stream program"
    REJECTED = "a set point for the real robot was rejected"
    DIVERGED = "the pair came apart"
    KEEP_OUT = "the way leads through a keep-out zone"
    TOO_CLOSE = "a person is too close"
    TOO_FAST = "the real robot is faster than the Cartesian limit"
    STOP = "STOP by the operator"
    PAUSE = "PAUSE by the operator"
    RESUME = "RESUME by the operator"
    RESUME_BLOCKED = "RESUME while its cause persists"
    RESET = "RESET by the operator"
    RESET_BLOCKED = "RESET while a link is down"
    RESET_DONE = "the real robot is ready again"
    RESET_FAILED = "the real robot did not become ready"
    ESTOP = "ESTOP by the operator"
    ALIGN = "ALIGN by the operator"
    MOVE = "a move by the operator"
    MOVE_UNALIGNED = "a move by the operator while the twin is not aligned"
    ACKNOWLEDGE = "ACKNOWLEDGE by the operator"


class Row(msgspec.Struct, frozen=True):
    """What a trigger does in a mode.

    Attributes:
        to: Next mode; None stays; ``RESUMED`` is the mode that was paused.
        do: Actions, in order.
        why: Added to the trigger's wording; for a refusal the reason.
        refused: The operator's command is refused.
        silent: Nothing is decided: no decision is recorded.
    """

    to: Mode | None = None
    do: tuple[Do, ...] = ()
    why: str = ""
    refused: bool = False
    silent: bool = False


STAY = Row(silent=True)
BOTH_STOP = (Do.STOP_REAL, Do.STOP_TWIN)
LEADING = (Mode.REAL_LEADS, Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)


def _refuse(why: str) -> Row:
    return Row(why=why, refused=True)


DEFAULTS: dict[Trigger, Row] = {
    Trigger.LINK_LOST: Row(Mode.OFFLINE, BOTH_STOP, "the side still reached is stopped"),
    Trigger.LINKS_READY: STAY,
    Trigger.ALIGNED: STAY,
    Trigger.ALIGN_FAILED: STAY,
    Trigger.REAL_MOVED: STAY,
    Trigger.REAL_TOOK_OVER: STAY,
    Trigger.REAL_WAS_FIRST: STAY,
    Trigger.TWIN_MOVED: STAY,
    Trigger.TWIN_MOVED_UNALIGNED: STAY,
    Trigger.AT_REST: STAY,
    Trigger.UNSETTLED: STAY,
    Trigger.REAL_FAULT: Row(Mode.FAULT, BOTH_STOP, "both are stopped; RESET once the cause is gone"),
    Trigger.REAL_DRIVES_OFF: Row(Mode.ESTOP, (Do.ESTOP_TWIN, Do.STOP_REAL), "the twin freezes; RESET once the cause is gone"),
    Trigger.REAL_HELD: STAY,
    Trigger.REAL_RELEASED: STAY,
    Trigger.REAL_STOPPED: STAY,
    Trigger.TWIN_STOPPED: STAY,
    Trigger.TWIN_PAUSED: STAY,
    Trigger.TWIN_RESUMED: STAY,
    Trigger.TWIN_ESTOPPED: Row(Mode.ESTOP, (Do.ESTOP_REAL,), "latched; RESET once the cause is gone"),
    Trigger.ESTOP_MISSED: STAY,
    Trigger.STOP_IGNORED: Row(
        Mode.ESTOP, (Do.ESTOP_REAL, Do.ESTOP_TWIN), "its drives are switched off; RESET once the cause is gone"
    ),
    Trigger.RELEASED_BLOCKED: STAY,
    Trigger.STREAM_FAILED: STAY,
    Trigger.REJECTED: STAY,
    Trigger.DIVERGED: STAY,
    Trigger.KEEP_OUT: STAY,
    Trigger.TOO_CLOSE: STAY,
    Trigger.TOO_FAST: STAY,
    Trigger.STOP: Row(Mode.STOPPED, BOTH_STOP, "the target is cleared"),
    Trigger.PAUSE: _refuse("nothing moves that could be paused"),
    Trigger.RESUME: _refuse("nothing is paused"),
    Trigger.RESUME_BLOCKED: _refuse("nothing is paused"),
    Trigger.RESET: _refuse("there is nothing to reset"),
    Trigger.RESET_BLOCKED: _refuse("there is nothing to reset"),
    Trigger.RESET_DONE: STAY,
    Trigger.RESET_FAILED: STAY,
    Trigger.ESTOP: Row(Mode.ESTOP, (Do.ESTOP_REAL, Do.ESTOP_TWIN), "latched; RESET releases it, and nothing moves by that"),
    Trigger.ALIGN: _refuse("the pair moves: STOP first"),
    Trigger.MOVE: _refuse("something else leads: STOP first"),
    Trigger.MOVE_UNALIGNED: _refuse("something else leads: STOP first"),
    Trigger.ACKNOWLEDGE: _refuse("there is nothing to acknowledge"),
}

_REAL_LEADS = Row(Mode.REAL_LEADS, (Do.BEGIN_FOLLOW_TWIN,), "the twin follows")
_TAKE_OVER = Row(Mode.REAL_LEADS, (Do.STOP_TWIN, Do.BEGIN_FOLLOW_TWIN), "the real robot wins; the twin's own motion ends")
_WAS_FIRST = Row(Mode.REAL_LEADS, (Do.STOP_REAL, Do.STOP_TWIN, Do.BEGIN_FOLLOW_TWIN), "its stream ends, the twin follows")
_TWIN_LEADS = Row(Mode.TWIN_LEADS, (Do.BEGIN_STREAM, Do.START_STREAM), "the real robot follows")
_OPERATOR_LEADS = Row(Mode.OPERATOR_LEADS, (Do.BEGIN_STREAM, Do.START_STREAM, Do.MOVE_TWIN), "both are commanded")
_TO_IDLE = Row(Mode.IDLE, (Do.RELEASE_TWIN, Do.BASELINE), "the positions are agreed")
_TO_IDLE_STREAMED = Row(Mode.IDLE, (Do.STOP_REAL, Do.BASELINE), "the positions are agreed")
_ALIGN = Row(Mode.ALIGNING, (Do.BEGIN_ALIGN,), "the twin goes slowly to the real robot's pose")
_REALIGN = Row(Mode.ALIGNING, (Do.STOP_REAL, Do.BEGIN_ALIGN), "the twin goes slowly to the real robot's pose")
_NO_LEAD = Row(Mode.ALIGNING, (Do.STOP_TWIN, Do.BEGIN_ALIGN), "it aligns first; send the command again afterwards")
_PAUSE_TWIN = Row(Mode.PAUSED, (Do.PAUSE_TWIN,), "the target is kept")
_HOLD_REAL = Row(Mode.PAUSED, (Do.HOLD_REAL,), "the target is kept")
_BEFORE_ZONE = Row(Mode.STOPPED, BOTH_STOP, "both are stopped before it")
_PROTECT = Row(Mode.PAUSED, (Do.HOLD_REAL, Do.PAUSE_TWIN), "protective stop; RESUME once the person is gone")
_DIVERGED = Row(Mode.PAUSED, (Do.HOLD_REAL, Do.PAUSE_TWIN), "both are paused until the operator acknowledges")
_GUARDED = Row(None, (Do.STOP_REAL,), "the real robot moves all the same and is stopped")
_STOPPED = Row(Mode.STOPPED, BOTH_STOP, "both are stopped")
_FAILED = Row(Mode.FAULT, BOTH_STOP, "both are stopped; RESET, then ALIGN")
_OFFLINE = _refuse("a link is down")
_LATCHED = _refuse("the emergency stop is latched: RESET first")
_FAULTED = _refuse("a fault is active: RESET first")
_RESET = Row(None, (Do.RESET_REAL,), "the real robot is asked to reset; nothing moves")
_RESET_DONE = Row(Mode.STOPPED, (Do.RESET_TWIN,), "nothing moves; ALIGN or a new command goes on")
_RESET_FAILED = Row(None, (), "its cause persists: remove it, then RESET again")

_FOLLOWING: dict[Trigger, Row] = {
    Trigger.KEEP_OUT: _BEFORE_ZONE,
    Trigger.TOO_CLOSE: _PROTECT,
    Trigger.TOO_FAST: _STOPPED,
    Trigger.TWIN_STOPPED: _STOPPED,
    Trigger.DIVERGED: _DIVERGED,
}
_STREAMING: dict[Trigger, Row] = {
    **_FOLLOWING,
    Trigger.AT_REST: _TO_IDLE_STREAMED,
    Trigger.UNSETTLED: _REALIGN,
    Trigger.REAL_TOOK_OVER: _TAKE_OVER,
    Trigger.REAL_WAS_FIRST: _WAS_FIRST,
    Trigger.REAL_HELD: _PAUSE_TWIN,
    Trigger.REAL_STOPPED: _STOPPED,
    Trigger.TWIN_PAUSED: Row(Mode.PAUSED, (), "the target is kept"),
    Trigger.STREAM_FAILED: _FAILED,
    Trigger.REJECTED: _STOPPED,
    Trigger.PAUSE: _PAUSE_TWIN,
}

ROWS: dict[Mode, dict[Trigger, Row]] = {
    Mode.OFFLINE: {
        Trigger.LINKS_READY: Row(
            Mode.ALIGNING, (Do.STOP_TWIN, Do.BEGIN_ALIGN), "nothing is replayed, the twin's own motion ends; it aligns slowly"
        ),
        Trigger.LINK_LOST: Row(None, BOTH_STOP, "the side still reached is stopped"),
        Trigger.REAL_FAULT: STAY,
        Trigger.REAL_DRIVES_OFF: STAY,
        Trigger.TWIN_ESTOPPED: STAY,
        Trigger.KEEP_OUT: _GUARDED,
        Trigger.TOO_CLOSE: _GUARDED,
        Trigger.TOO_FAST: _GUARDED,
        Trigger.STOP: Row(None, BOTH_STOP, "sent to the side still reached; a robot that is not is told when it answers again"),
        Trigger.PAUSE: _OFFLINE,
        Trigger.RESUME: _OFFLINE,
        Trigger.RESUME_BLOCKED: _OFFLINE,
        Trigger.RESET: _OFFLINE,
        Trigger.RESET_BLOCKED: _OFFLINE,
        Trigger.ALIGN: _OFFLINE,
        Trigger.MOVE: _OFFLINE,
        Trigger.MOVE_UNALIGNED: _OFFLINE,
        Trigger.ACKNOWLEDGE: _OFFLINE,
    },
    Mode.ALIGNING: {
        Trigger.ALIGNED: Row(Mode.IDLE, (Do.RELEASE_TWIN, Do.BASELINE), "the pair is ready"),
        Trigger.ALIGN_FAILED: _FAILED,
        Trigger.KEEP_OUT: _BEFORE_ZONE,
        Trigger.TOO_CLOSE: _STOPPED,
        Trigger.TOO_FAST: _STOPPED,
        Trigger.TWIN_STOPPED: _STOPPED,
        Trigger.ALIGN: Row(None, (), "already aligning"),
        Trigger.MOVE: _refuse("the twin is aligning: wait"),
        Trigger.MOVE_UNALIGNED: _refuse("the twin is aligning: wait"),
        Trigger.PAUSE: _refuse("the twin is aligning: STOP ends it"),
    },
    Mode.IDLE: {
        Trigger.KEEP_OUT: _BEFORE_ZONE,
        Trigger.TOO_FAST: _STOPPED,
        Trigger.REAL_MOVED: _REAL_LEADS,
        Trigger.REAL_TOOK_OVER: _REAL_LEADS,
        Trigger.TWIN_MOVED: _TWIN_LEADS,
        Trigger.TWIN_MOVED_UNALIGNED: _NO_LEAD,
        Trigger.ALIGN: _ALIGN,
        Trigger.MOVE: _OPERATOR_LEADS,
        Trigger.MOVE_UNALIGNED: _refuse("the twin is not aligned: ALIGN first"),
    },
    Mode.REAL_LEADS: {
        **_FOLLOWING,
        Trigger.AT_REST: _TO_IDLE,
        Trigger.UNSETTLED: _REALIGN,
        Trigger.TWIN_PAUSED: _HOLD_REAL,
        Trigger.PAUSE: _HOLD_REAL,
    },
    Mode.TWIN_LEADS: _STREAMING,
    Mode.OPERATOR_LEADS: _STREAMING,
    Mode.PAUSED: {
        Trigger.TWIN_STOPPED: _STOPPED,
        Trigger.REAL_STOPPED: _STOPPED,
        Trigger.REAL_TOOK_OVER: _TAKE_OVER,
        Trigger.RELEASED_BLOCKED: _STOPPED,
        Trigger.REJECTED: _STOPPED,
        Trigger.PAUSE: Row(None, (), "already paused"),
        Trigger.ACKNOWLEDGE: Row(None, (), "RESUME is possible again"),
        Trigger.RESUME_BLOCKED: _refuse("ACKNOWLEDGE a divergence; wait until a person is gone"),
        Trigger.ALIGN: _refuse("a motion is paused: STOP first"),
    },
    Mode.STOPPED: {
        Trigger.KEEP_OUT: Row(None, BOTH_STOP, "both are stopped before it"),
        Trigger.TOO_FAST: Row(None, BOTH_STOP, "both are stopped"),
        Trigger.REAL_MOVED: _REAL_LEADS,
        Trigger.REAL_TOOK_OVER: _REAL_LEADS,
        Trigger.TWIN_MOVED: _TWIN_LEADS,
        Trigger.TWIN_MOVED_UNALIGNED: _NO_LEAD,
        Trigger.ALIGN: _ALIGN,
        Trigger.MOVE: _OPERATOR_LEADS,
        Trigger.MOVE_UNALIGNED: _refuse("the twin is not aligned: ALIGN first"),
    },
    Mode.ESTOP: {
        Trigger.LINK_LOST: Row(None, BOTH_STOP, "the emergency stop stays latched"),
        Trigger.REAL_FAULT: STAY,
        Trigger.REAL_DRIVES_OFF: STAY,
        Trigger.TWIN_ESTOPPED: STAY,
        Trigger.STOP_IGNORED: STAY,
        Trigger.ESTOP_MISSED: Row(None, (Do.ESTOP_REAL, Do.ESTOP_TWIN), "sent again"),
        Trigger.STOP: Row(None, BOTH_STOP, "the emergency stop stays latched"),
        Trigger.ESTOP: Row(None, (Do.ESTOP_REAL, Do.ESTOP_TWIN), "already latched; sent again"),
        Trigger.RESET: _RESET,
        Trigger.RESET_BLOCKED: _OFFLINE,
        Trigger.RESET_DONE: _RESET_DONE,
        Trigger.RESET_FAILED: _RESET_FAILED,
        Trigger.PAUSE: _LATCHED,
        Trigger.RESUME: _LATCHED,
        Trigger.RESUME_BLOCKED: _LATCHED,
        Trigger.ALIGN: _LATCHED,
        Trigger.MOVE: _LATCHED,
        Trigger.MOVE_UNALIGNED: _LATCHED,
    },
    Mode.FAULT: {
        Trigger.LINK_LOST: Row(None, BOTH_STOP, "the fault stays until RESET"),
        Trigger.KEEP_OUT: _GUARDED,
        Trigger.TOO_CLOSE: _GUARDED,
        Trigger.TOO_FAST: _GUARDED,
        Trigger.REAL_FAULT: STAY,
        Trigger.STOP: Row(None, BOTH_STOP, "the fault stays until RESET"),
        Trigger.RESET: _RESET,
        Trigger.RESET_BLOCKED: _OFFLINE,
        Trigger.RESET_DONE: _RESET_DONE,
        Trigger.RESET_FAILED: _RESET_FAILED,
        Trigger.PAUSE: _FAULTED,
        Trigger.RESUME: _FAULTED,
        Trigger.RESUME_BLOCKED: _FAULTED,
        Trigger.ALIGN: _FAULTED,
        Trigger.MOVE: _FAULTED,
        Trigger.MOVE_UNALIGNED: _FAULTED,
    },
}

# Going on after PAUSE depends on who led; the mode that was paused comes back.
RESUME_ROWS: dict[Mode, Row] = {
    Mode.REAL_LEADS: Row(Mode.REAL_LEADS, (Do.RELEASE_REAL,), "the same path goes on"),
    Mode.TWIN_LEADS: Row(Mode.TWIN_LEADS, (Do.RELEASE_REAL, Do.BEGIN_STREAM, Do.RESUME_TWIN), "the same path goes on"),
    Mode.OPERATOR_LEADS: Row(Mode.OPERATOR_LEADS, (Do.RELEASE_REAL, Do.BEGIN_STREAM, Do.RESUME_TWIN), "the same path goes on"),
}
RESUMING = (Trigger.RESUME, Trigger.REAL_RELEASED, Trigger.TWIN_RESUMED)


def look_up(mode: Mode, trigger: Trigger, paused: Mode | None = None) -> Row:
    """Return the row of (mode, trigger).

    Args:
        mode: Mode now.
        trigger: What happened.
        paused: In PAUSED, the mode that was paused.
    """
    if mode is Mode.PAUSED and trigger in RESUMING and paused in RESUME_ROWS:
        return RESUME_ROWS[paused]
    return ROWS[mode].get(trigger, DEFAULTS[trigger])
