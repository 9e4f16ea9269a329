"""The state machine as a table: (mode, trigger) -> (next mode, actions, why).

Every pair has a row: ``DEFAULTS`` says what a trigger does unless ``ROWS`` says otherwise for a
mode; what neither names decides nothing. Conditions are part of the trigger (``MOVE`` or
``MOVE_UNALIGNED``), so that a row never decides anything.
"""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import Command
from twin_controller.core.lead.modes import SAFETY_TRIGGERS, Mode, Trigger


class Row(msgspec.Struct, frozen=True):
    """What a trigger does in a mode.

    Attributes:
        to: Next mode; None stays; ``RESUMED`` is the mode that was paused.
        commands: Sent in this order.
        why: Added to the trigger's wording; for a refusal the reason.
        refused: The operator's command is refused.
        silent: Nothing is decided: no decision is recorded.
    """

    to: Mode | None = None
    commands: tuple[Command, ...] = ()
    why: str = ""
    refused: bool = False
    silent: bool = False


STAY = Row(silent=True)
BOTH_STOP = (Command.STOP_REAL, Command.STOP_TWIN)

FOLLOWS_TWIN = (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)
ENDED_ON_TWIN = (Trigger.TWIN_STOPPED, Trigger.TWIN_PAUSED)
LEADING = (Mode.REAL_LEADS, *FOLLOWS_TWIN)
LEADERS = {Mode.REAL_LEADS: "real", Mode.TWIN_LEADS: "twin", Mode.OPERATOR_LEADS: "operator"}


def _refuse(why: str) -> Row:
    return Row(why=why, refused=True)


_RESUMES = (*(Trigger.RESUME, Trigger.RESUME_BLOCKED), *(Trigger.RESUME_HELD, Trigger.RESUME_MOVED))
_RESETS = (Trigger.RESET, Trigger.RESET_BLOCKED, Trigger.RESET_PRESSED)
DEFAULTS: dict[Trigger, Row] = {
    # What must be stopped in every mode, unless a mode below says more.
    Trigger.LINK_LOST: Row(Mode.OFFLINE, BOTH_STOP, "the side still reached is stopped"),
    Trigger.REAL_FAULT: Row(
        Mode.FAULT, BOTH_STOP, "both are stopped; RESET once the cause is gone"
    ),
    Trigger.REAL_DRIVES_OFF: Row(
        Mode.ESTOP,
        (Command.ESTOP_TWIN, Command.STOP_REAL),
        "the twin freezes; RESET once the cause is gone",
    ),
    Trigger.TWIN_ESTOPPED: Row(
        Mode.ESTOP, (Command.ESTOP_REAL,), "latched; RESET once the cause is gone"
    ),
    Trigger.STOP_IGNORED: Row(
        Mode.ESTOP,
        (Command.ESTOP_REAL, Command.ESTOP_TWIN),
        "its drives are switched off; RESET once the cause is gone",
    ),
    # It has no drives to switch off; the real robot obeys and keeps its own.
    Trigger.TWIN_STOP_IGNORED: Row(
        Mode.FAULT, BOTH_STOP, "end the simulator or what commands it, then RESET"
    ),
    Trigger.STOP: Row(Mode.STOPPED, BOTH_STOP, "the target is cleared"),
    Trigger.STANDSTILL: Row(
        Mode.STANDSTILL,
        BOTH_STOP,
        "the target is cleared; with the drives on, a side that moves is a fault; RESET ends it",
    ),
    Trigger.PAUSE: _refuse("the pair is stopped"),
    **dict.fromkeys(_RESUMES, _refuse("nothing is paused")),
    **dict.fromkeys(_RESETS, _refuse("there is nothing to reset")),
    Trigger.ESTOP: Row(
        Mode.ESTOP,
        (Command.ESTOP_REAL, Command.ESTOP_TWIN),
        "latched; RESET releases it, and nothing moves by that",
    ),
    Trigger.ALIGN: _refuse("the pair moves: STOP first"),
    Trigger.MOVE: _refuse("something else leads: STOP first"),
    Trigger.MOVE_UNALIGNED: _refuse("something else leads: STOP first"),
    **dict.fromkeys(
        (Trigger.ACKNOWLEDGE, Trigger.ACKNOWLEDGE_NOTHING),
        _refuse("there is nothing to acknowledge"),
    ),
}

# Rows that several modes share.
_REAL_LEADS = Row(Mode.REAL_LEADS, (Command.BEGIN_FOLLOW_TWIN,), "the twin follows")
# A stream that was asked for too late waits for the end of the robot's program: what was meant for
# it must not move the robot then. Its CSTOPI would end that program.
_TAKE_OVER = Row(
    Mode.REAL_LEADS,
    (Command.END_STREAM, Command.YIELD_TWIN, Command.BEGIN_FOLLOW_TWIN),
    "the real robot wins; the twin's own motion ends",
)
_WAS_FIRST = Row(
    Mode.REAL_LEADS,
    (Command.STOP_REAL, Command.YIELD_TWIN, Command.BEGIN_FOLLOW_TWIN),
    "its stream ends, the twin follows",
)
_TWIN_LEADS = Row(
    Mode.TWIN_LEADS, (Command.BEGIN_STREAM, Command.START_STREAM), "the real robot follows"
)
_OPERATOR_LEADS = Row(
    Mode.OPERATOR_LEADS,
    (Command.BEGIN_STREAM, Command.START_STREAM, Command.MOVE_TWIN),
    "both are commanded",
)
_TO_IDLE = Row(Mode.IDLE, (Command.RELEASE_TWIN, Command.BASELINE), "the positions are agreed")
_TO_IDLE_STREAMED = Row(
    Mode.IDLE, (Command.END_AT_REST, Command.BASELINE), "the positions are agreed"
)
_TO_IDLE_UNLED = Row(
    Mode.IDLE,
    (Command.RELEASE_TWIN, Command.END_AT_REST, Command.BASELINE),
    "it is ended, the positions are agreed",
)
_ALIGN = Row(Mode.ALIGNING, (Command.BEGIN_ALIGN,), "the twin goes slowly to the real robot's pose")
_REALIGN = Row(
    Mode.ALIGNING,
    (Command.STOP_REAL, Command.BEGIN_ALIGN),
    "the twin goes slowly to the real robot's pose",
)
_NO_LEAD = Row(
    Mode.ALIGNING,
    (Command.STOP_TWIN, Command.BEGIN_ALIGN),
    "it aligns first; send the command again afterwards",
)
_UNASKED = Row(Mode.STOPPED, BOTH_STOP, "it is stopped; ask for control, or wait until it is free")
# Both sides are held whoever leads, and the stream ends: nothing that moves the twin, or comes
# late, moves the robot.
_PAUSE = Row(Mode.PAUSED, (Command.HOLD_REAL, Command.PAUSE_TWIN), "the target is kept")
_TWIN_PAUSED = Row(Mode.PAUSED, (Command.HOLD_REAL,), "the target is kept")
# The hold is that of the person at the robot, who lets it go; only the stream is ours to end.
_REAL_HELD = Row(Mode.PAUSED, (Command.END_STREAM, Command.PAUSE_TWIN), "the target is kept")
_BEFORE_ZONE = Row(Mode.STOPPED, BOTH_STOP, "both are stopped before it")
_PROTECT = Row(
    Mode.PAUSED,
    (Command.HOLD_REAL, Command.PAUSE_TWIN),
    "protective stop; RESUME once the person is gone",
)
_DIVERGED = Row(
    Mode.PAUSED,
    (Command.HOLD_REAL, Command.PAUSE_TWIN),
    "both are paused until the operator acknowledges",
)
# What a person wants who would go on, or hold what goes on.
_GOING_ON = (
    *(Trigger.PAUSE, Trigger.RESUME, Trigger.RESUME_BLOCKED, Trigger.RESUME_HELD),
    *(Trigger.ALIGN, Trigger.MOVE, Trigger.MOVE_UNALIGNED, Trigger.STANDSTILL),
)
_WATCHED = _refuse("the standstill is monitored: RESET ends it")
_GUARDED = Row(None, (Command.STOP_REAL,), "the real robot moves all the same and is stopped")
_STOPPED = Row(Mode.STOPPED, BOTH_STOP, "both are stopped")
_FAILED = Row(Mode.FAULT, BOTH_STOP, "both are stopped; RESET, then ALIGN")
_OFFLINE = _refuse("a link is down")
_LATCHED = _refuse("the emergency stop is latched: RESET first")
_FAULTED = _refuse("a fault is active: RESET first")
# Who has pressed a button at the robot releases it there; nobody else does.
_HELD_THERE = _refuse("the robot is held at its pendant: let it go there, then RESUME again")
_PRESSED = _refuse("the emergency stop at the robot is pressed: release it there, then RESET again")
_RESET = Row(None, (Command.RESET_REAL,), "the real robot is asked to reset; nothing moves")
_RESET_DONE = Row(Mode.STOPPED, (Command.RESET_TWIN,), "nothing moves; ALIGN goes on")
_TWIN_DEFIES = Row(None, (), "end the simulator or what commands it, then RESET")
_NOTHING_LEFT = Row(None, (), "press the emergency stop at the robot itself")
_RESET_FAILED = Row(None, (), "remove the cause, then RESET again")

# While the twin follows, and what a stream to the real robot adds.
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
    Trigger.REAL_HELD: _REAL_HELD,
    Trigger.REAL_STOPPED: _STOPPED,
    Trigger.TWIN_PAUSED: _TWIN_PAUSED,
    Trigger.STREAM_FAILED: _FAILED,
    Trigger.REJECTED: _STOPPED,
    Trigger.PAUSE: _PAUSE,
}

ROWS: dict[Mode, dict[Trigger, Row]] = {
    # A side may be unknown: only stops are sent, and they wait for a robot that is away.
    Mode.OFFLINE: {
        Trigger.LINKS_READY: Row(
            Mode.ALIGNING,
            (Command.STOP_TWIN, Command.BEGIN_ALIGN),
            "nothing is replayed, the twin's own motion ends; it aligns slowly",
        ),
        # A link that blinks ends no stop. Stops that did not arrive are sent by their own order; a
        # program that somebody at the robot began meanwhile is left to that person.
        Trigger.LINKS_READY_STOPPED: Row(
            Mode.STOPPED, (Command.STOP_TWIN,), "it stays stopped; ALIGN goes on"
        ),
        Trigger.LINK_LOST: Row(None, BOTH_STOP, "the side still reached is stopped"),
        Trigger.REAL_FAULT: STAY,
        Trigger.REAL_DRIVES_OFF: STAY,
        Trigger.TWIN_ESTOPPED: STAY,
        **dict.fromkeys(SAFETY_TRIGGERS, _GUARDED),
        Trigger.STOP: Row(
            None,
            BOTH_STOP,
            "sent to the side still reached, and to a robot that is not when it answers again; "
            "the pair stays stopped, and ALIGN goes on",
        ),
        **dict.fromkeys(ENDED_ON_TWIN, Row(None, (), "the pair stays stopped, and ALIGN goes on")),
        **dict.fromkeys(_GOING_ON, _OFFLINE),
        **dict.fromkeys(_RESETS, _OFFLINE),
        Trigger.ACKNOWLEDGE: _OFFLINE,
    },
    # The twin goes slowly; nobody may take the lead from it, but anything may stop it.
    Mode.ALIGNING: {
        Trigger.ALIGNED: Row(
            Mode.IDLE, (Command.RELEASE_TWIN, Command.BASELINE), "the pair is ready"
        ),
        # Let go, the twin would stop first, and lose a robot that moves fast.
        Trigger.CAUGHT_UP: Row(Mode.REAL_LEADS, (), "it goes on following"),
        Trigger.ALIGN_FAILED: _FAILED,
        Trigger.KEEP_OUT: _BEFORE_ZONE,
        Trigger.TOO_CLOSE: _STOPPED,
        Trigger.TOO_FAST: _STOPPED,
        Trigger.TWIN_STOPPED: _STOPPED,
        Trigger.ALIGN: Row(None, (), "already aligning"),
        Trigger.MOVE: _refuse("the twin is aligning: wait"),
        Trigger.MOVE_UNALIGNED: _refuse("the twin is aligning: wait"),
        Trigger.PAUSE: _PAUSE,
    },
    # Both stand where they have agreed: who moves first leads.
    Mode.IDLE: {
        Trigger.KEEP_OUT: _BEFORE_ZONE,
        Trigger.TOO_FAST: _STOPPED,
        Trigger.REAL_MOVED: _REAL_LEADS,
        Trigger.REAL_TOOK_OVER: _REAL_LEADS,
        Trigger.TWIN_MOVED: _TWIN_LEADS,
        Trigger.TWIN_MOVED_UNALIGNED: _NO_LEAD,
        Trigger.TWIN_MOVED_UNASKED: _UNASKED,
        Trigger.TWIN_MOVED_UNLED: Row(Mode.STOPPED, BOTH_STOP, "it is stopped; ALIGN goes on"),
        Trigger.TWIN_PAUSED: _TWIN_PAUSED,
        Trigger.PAUSE: _PAUSE,
        Trigger.ALIGN: _ALIGN,
        Trigger.MOVE: _OPERATOR_LEADS,
        Trigger.MOVE_UNALIGNED: _refuse("the twin is not aligned: ALIGN first"),
    },
    Mode.REAL_LEADS: {
        **_FOLLOWING,
        Trigger.AT_REST: _TO_IDLE,
        Trigger.AT_REST_STREAMED: _TO_IDLE_UNLED,
        Trigger.UNSETTLED: _REALIGN,
        # Both were started at once: the twin's own move was announced when the robot took the lead.
        Trigger.TWIN_MOVES_TOO: Row(
            None, (Command.YIELD_TWIN, Command.BEGIN_FOLLOW_TWIN), "its own motion ends, it follows"
        ),
        Trigger.TWIN_PAUSED: _TWIN_PAUSED,
        Trigger.PAUSE: _PAUSE,
    },
    Mode.TWIN_LEADS: _STREAMING,
    Mode.OPERATOR_LEADS: _STREAMING,
    # Only RESUME goes on, or whoever has paused the pair on his own side; all else stops it.
    Mode.PAUSED: {
        Trigger.KEEP_OUT: _BEFORE_ZONE,
        Trigger.TOO_CLOSE: _STOPPED,
        Trigger.TOO_FAST: _STOPPED,
        Trigger.TWIN_STOPPED: _STOPPED,
        Trigger.REAL_STOPPED: _STOPPED,
        Trigger.REAL_TOOK_OVER: _TAKE_OVER,
        Trigger.RELEASED_BLOCKED: _STOPPED,
        Trigger.TWIN_MOVED_PAUSED: Row(None, (Command.PAUSE_TWIN,), "it is held again"),
        Trigger.REJECTED: _STOPPED,
        Trigger.PAUSE: Row(None, (), "already paused"),
        Trigger.ACKNOWLEDGE: Row(None, (), "the divergence is acknowledged"),
        Trigger.RESUME_BLOCKED: _refuse("ACKNOWLEDGE a divergence; wait until a person is gone"),
        Trigger.RESUME_HELD: _HELD_THERE,
        Trigger.RESUME_MOVED: Row(
            Mode.STOPPED,
            BOTH_STOP,
            "it no longer stands where it was paused: the target is cleared",
            refused=True,
        ),
        Trigger.ALIGN: _refuse("a motion is paused: STOP first"),
    },
    # Targets are cleared. Only a person goes on, here or at the robot: what moves the twin may have
    # begun before the stop and never heard of it.
    Mode.STOPPED: {
        Trigger.KEEP_OUT: Row(None, BOTH_STOP, "both are stopped before it"),
        **dict.fromkeys(
            (Trigger.TOO_CLOSE, Trigger.TOO_FAST), Row(None, BOTH_STOP, "both are stopped")
        ),
        Trigger.REAL_MOVED: _REAL_LEADS,
        Trigger.REAL_TOOK_OVER: _REAL_LEADS,
        Trigger.TWIN_MOVED_STOPPED: Row(
            None, (Command.STOP_TWIN,), "it is stopped again; ALIGN, then it may lead"
        ),
        Trigger.ALIGN: _ALIGN,
        Trigger.MOVE: _OPERATOR_LEADS,
        Trigger.MOVE_UNALIGNED: _refuse("the twin is not aligned: ALIGN first"),
    },
    # As STOPPED, but nothing may move, at the robot either: only RESET leaves it.
    Mode.STANDSTILL: {
        **dict.fromkeys((Trigger.STANDSTILL_LOST, Trigger.REAL_TOOK_OVER), _FAILED),
        # Nobody watched while a link was away.
        **dict.fromkeys((Trigger.LINK_LOST, Trigger.KEEP_OUT, Trigger.TOO_FAST), _FAILED),
        Trigger.STOP: Row(None, BOTH_STOP, "the standstill stays monitored"),
        **dict.fromkeys(_GOING_ON, _WATCHED),
        Trigger.STANDSTILL: Row(None, (), "already monitored"),
        **dict.fromkeys(
            (Trigger.RESET, Trigger.RESET_PRESSED),
            Row(Mode.STOPPED, BOTH_STOP, "the standstill is no longer monitored; ALIGN goes on"),
        ),
        Trigger.RESET_BLOCKED: _OFFLINE,
    },
    # Latched: only RESET leaves it, and only once the cause is gone.
    Mode.ESTOP: {
        Trigger.LINK_LOST: Row(None, BOTH_STOP, "the emergency stop stays latched"),
        Trigger.REAL_FAULT: STAY,
        Trigger.REAL_DRIVES_OFF: STAY,
        Trigger.TWIN_ESTOPPED: STAY,
        Trigger.STOP_IGNORED: STAY,
        Trigger.ESTOP_IGNORED: _NOTHING_LEFT,
        Trigger.TWIN_STOP_IGNORED: _TWIN_DEFIES,
        Trigger.ESTOP_MISSED: Row(None, (Command.ESTOP_REAL, Command.ESTOP_TWIN), "sent again"),
        Trigger.STOP: Row(None, BOTH_STOP, "the emergency stop stays latched"),
        Trigger.ESTOP: Row(
            None, (Command.ESTOP_REAL, Command.ESTOP_TWIN), "already latched; sent again"
        ),
        Trigger.RESET: _RESET,
        Trigger.RESET_BLOCKED: _OFFLINE,
        Trigger.RESET_PRESSED: _PRESSED,
        Trigger.RESET_DONE: _RESET_DONE,
        Trigger.RESET_FAILED: _RESET_FAILED,
        **dict.fromkeys(_GOING_ON, _LATCHED),
    },
    # As ESTOP, with the drives on.
    Mode.FAULT: {
        Trigger.LINK_LOST: Row(None, BOTH_STOP, "the fault stays until RESET"),
        **dict.fromkeys(SAFETY_TRIGGERS, _GUARDED),
        Trigger.REAL_TOOK_OVER: Row(None, (), "the twin does not follow it before RESET"),
        Trigger.REAL_FAULT: STAY,
        Trigger.TWIN_STOP_IGNORED: _TWIN_DEFIES,
        Trigger.STOP: Row(None, BOTH_STOP, "the fault stays until RESET"),
        Trigger.RESET: _RESET,
        Trigger.RESET_BLOCKED: _OFFLINE,
        Trigger.RESET_PRESSED: _PRESSED,
        Trigger.RESET_DONE: _RESET_DONE,
        Trigger.RESET_FAILED: _RESET_FAILED,
        **dict.fromkeys(_GOING_ON, _FAULTED),
    },
}

# Going on after PAUSE depends on who led; the mode that was paused comes back.
# The robot's stream goes on behind a fresh set point, not by RESUME itself.
_BEGIN = (Command.GIVE_HOLD_BACK, Command.BEGIN_STREAM, Command.START_STREAM)
_RESUME_STREAM = (*_BEGIN, Command.RESUME_TWIN)
RESUME_ROWS: dict[Mode, Row] = {
    Mode.ALIGNING: Row(
        Mode.ALIGNING,
        (Command.GIVE_HOLD_BACK, Command.RESUME_TWIN, Command.BEGIN_ALIGN),
        "the twin goes on to the real robot's pose",
    ),
    Mode.IDLE: Row(
        Mode.IDLE,
        (Command.GIVE_HOLD_BACK, Command.RESUME_TWIN, Command.BASELINE),
        "who moves first leads",
    ),
    Mode.REAL_LEADS: Row(
        Mode.REAL_LEADS, (Command.RELEASE_REAL, Command.RESUME_TWIN), "the same path goes on"
    ),
    Mode.TWIN_LEADS: Row(Mode.TWIN_LEADS, _RESUME_STREAM, "the same path goes on"),
    Mode.OPERATOR_LEADS: Row(Mode.OPERATOR_LEADS, _RESUME_STREAM, "the same path goes on"),
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
    return ROWS[mode].get(trigger, DEFAULTS.get(trigger, STAY))
