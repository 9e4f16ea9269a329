"""Who leads, why, and what must happen before somebody else may."""

from __future__ import annotations

import msgspec
from scara_ros.standstill import said

from twin_controller.core.actions import Decided
from twin_controller.core.control import Control
from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.lead.repeated import Repeated


class Lead(msgspec.Struct, frozen=True):
    """The controller's mode and what belongs to it."""

    mode: Mode = Mode.OFFLINE
    # real, twin, operator; empty while nobody leads. A pause keeps it.
    leader: str = ""
    why: str = "started; no link is up yet"
    # When the mode was entered [s].
    since: float = 0.0
    # Number of the newest decision.
    seq: int = 0
    # The newest decisions, for people; nothing is decided by them.
    decisions: tuple[Decided, ...] = ()
    # Both sides were usable at the last look; on the edge a link counts as lost.
    links_up: bool = False
    # The pair was stopped or paused when a link was lost, or while it was: it comes back stopped.
    was_stopped: bool = False
    # The mode that PAUSE interrupted, while it does.
    paused: Mode | None = None
    # What paused the pair: a side that has paused it may let it go on, no other one.
    paused_by: Trigger | None = None
    # Whether the real robot and the twin have shown since that they paused: before that, a side
    # that moves has not gone on but has not stopped yet.
    paused_seen: tuple[bool, bool] = (False, False)
    # The pair came apart and is paused; ends with ACKNOWLEDGE, or when the pause ends.
    needs_acknowledge: bool = False
    # A latched stop was reset: until the pair aligns the twin may not lead.
    must_align: bool = False
    # When the real robot was asked to reset [s]; None once that has succeeded or failed.
    reset_since: float | None = None
    # It was said that the twin moves in spite of a stop; once in a stop, and again after a STOP.
    twin_named: bool = False
    # It was said that the robot moves in spite of all that can be done from here; once in a mode.
    helpless: bool = False
    # The robot's own program was seen ended since the last stop: one that runs on is no new one.
    program_was_off: bool = True
    # What the robot's newest readings say of its programs, one after the other.
    repeated: Repeated = Repeated()
    # The twin has not answered the operator's newest move yet; a pair that waits for it is not at
    # rest. Its number: the answer to an older one may come later.
    move_pending: bool = False
    move: int = 0
    # Why the operator's last accepted move did not reach its target; until the next one begins.
    move_failed: str = ""
    # At what the real robot's mode switch was seen last; what is not told counts as AUTO.
    operation_mode: str = "AUTO"
    # Who may begin a motion by command or on the twin's side.
    control: Control = Control()
    # When the pair was stopped or paused last [s], and by what: what was asked for before that
    # never begins.
    ended: float = 0.0
    ended_by: str = ""


def end_epoch(lead: Lead, by: str, now: float) -> Lead:
    """Note that the pair was stopped or paused by something."""
    return msgspec.structs.replace(lead, ended=now, ended_by=by)


def cancelled(lead: Lead, asked: float, now: float) -> str:
    """Return why a command comes too late, or an empty text.

    Args:
        lead: The lead before it.
        asked: When it was asked for [s]; 0: now.
        now: When it is heard [s].
    """
    if (asked if said(asked, now) else now) >= lead.ended:
        return ""
    return f"cancelled by {lead.ended_by}, before it began"


def record(lead: Lead, decision: Decided, history: int) -> Lead:
    """Keep a decision, and forget all but the newest ``history``."""
    kept = (*lead.decisions, decision)[-history:]
    return msgspec.structs.replace(lead, seq=decision.seq, decisions=kept)


def record_notice(
    lead: Lead,
    trigger: str,
    why: str,
    actions: tuple[str, ...],
    history: int,
    now: float,
    who: str = "",
) -> tuple[Lead, Decided]:
    """Record a decision that changes no mode."""
    mode = lead.mode.value
    decision = Decided(lead.seq + 1, now, mode, trigger, mode, lead.leader, actions, why, who=who)
    return record(lead, decision, history), decision
