"""What the state table is made of: the modes, and what can happen."""

from __future__ import annotations

from scara_config.text_enum import StrEnum


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
    STANDSTILL = "STANDSTILL"
    ESTOP = "ESTOP"
    FAULT = "FAULT"


class Trigger(StrEnum):
    """What can happen, conditions included. The value is the wording of ``why``."""

    LINK_LOST = "a link was lost"
    LINKS_READY = "both links are up and fresh"
    LINKS_READY_STOPPED = "both links are up again, and the pair was stopped before"
    ALIGNED = "the twin reached the real robot's pose"
    CAUGHT_UP = "the twin reached the real robot, which moves on its own"
    ALIGN_FAILED = "the twin did not reach the real robot's pose in time"
    REAL_MOVED = "the real robot moved first"
    REAL_TOOK_OVER = "the real robot moves on its own"
    TWIN_MOVES_TOO = "the twin moves on its own while it should follow"
    REAL_WAS_FIRST = "the real robot had moved before the twin"
    TWIN_MOVED = "the twin moved first"
    TWIN_MOVED_UNALIGNED = "the twin moved while it was not aligned"
    TWIN_MOVED_UNASKED = "the twin moved, and who holds control did not move it"
    TWIN_MOVED_UNLED = "the twin moved, and the real robot cannot be led"
    TWIN_MOVED_PAUSED = "the twin moved although the pair is paused"
    TWIN_MOVED_STOPPED = "the twin moved although the pair is stopped"
    AT_REST = "both stand still and agree"
    AT_REST_STREAMED = "both stand still, and a stream that was asked for earlier has begun"
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
    ESTOP_IGNORED = "the real robot moves although its drives were switched off"
    TWIN_STOP_IGNORED = "the twin does not obey a stop"
    STANDSTILL_LOST = "a side moved in the monitored standstill"
    RELEASED_BLOCKED = "a side goes on although the pair is paused"
    STREAM_FAILED = "the real robot does not start its stream program"
    REJECTED = "a set point for the real robot was rejected"
    DIVERGED = "the pair came apart"
    KEEP_OUT = "the way leads through a keep-out zone"
    TOO_CLOSE = "a person is too close"
    TOO_FAST = "the real robot is faster than the Cartesian limit"
    STOP = "STOP by the operator"
    STANDSTILL = "STANDSTILL by the operator"
    PAUSE = "PAUSE by the operator"
    RESUME = "RESUME by the operator"
    RESUME_BLOCKED = "RESUME while its cause persists"
    RESUME_MOVED = "RESUME after a side was moved"
    RESUME_HELD = "RESUME while the robot is held at its pendant"
    RESET = "RESET by the operator"
    RESET_BLOCKED = "RESET while a link is down"
    RESET_PRESSED = "RESET while the emergency stop at the robot is pressed"
    RESET_DONE = "the real robot is ready again"
    RESET_FAILED = "the real robot did not become ready"
    ESTOP = "ESTOP by the operator"
    ALIGN = "ALIGN by the operator"
    MOVE = "a move by the operator"
    MOVE_UNALIGNED = "a move by the operator while the twin is not aligned"
    ACKNOWLEDGE = "ACKNOWLEDGE by the operator"
    ACKNOWLEDGE_NOTHING = "ACKNOWLEDGE while nothing came apart"


COMMANDS = tuple(each.name for each in Trigger if each == f"{each.name} by the operator")
"""The operator's commands that are triggers of their own."""
MOVES = ("HOME", "MOVE", "MOVE_JOINTS")
EVERY_COMMAND = (*COMMANDS, *MOVES, "SPEED")
# Triggers that are decided by when each side moved: the decision tells these times.
ONSET_TRIGGERS = (
    Trigger.REAL_MOVED,
    Trigger.REAL_WAS_FIRST,
    Trigger.REAL_TOOK_OVER,
    Trigger.TWIN_MOVED,
    Trigger.TWIN_MOVED_UNALIGNED,
    Trigger.TWIN_MOVED_UNASKED,
    Trigger.TWIN_MOVED_UNLED,
)
SAFETY_TRIGGERS = (Trigger.KEEP_OUT, Trigger.TOO_CLOSE, Trigger.TOO_FAST)
