"""Who holds control, who asks for it, and when it is lost; pure.

Each function takes the state and returns the next one with an answer. A seat is a person at one
place: the same person on two pages has two seats, and only one of them may hold control.
STOP, PAUSE and ESTOP are never asked about here: whoever can call them may.
"""

from __future__ import annotations

from typing import NamedTuple

import msgspec
from scara_ros.names import Seat

replace = msgspec.structs.replace

ENDING = ("STOP", "PAUSE", "ESTOP", "STANDSTILL")
"""Commands that end a motion: they need no control and no person."""
THIS_MACHINE = "this machine"
"""Who commands without a person: a program of this machine."""


NOBODY = Seat()


class Control(msgspec.Struct, frozen=True):
    """Who holds control and who asks for it; times in [s]."""

    holder: Seat = NOBODY
    # Since when, and the holder's last sign of life.
    since: float = 0.0
    seen: float = 0.0
    # The holder moves the twin without a command to us: a jog, move_to, an action.
    moves: bool = False
    # Until then a motion of the twin is that of the holder's own programs on this machine [s].
    lent: float = 0.0
    # Who asks the holder, since when, and the last sign of life.
    asker: Seat = NOBODY
    asked: float = 0.0
    asker_seen: float = 0.0
    # What the asker will say of the twin's motion once it holds control.
    asker_moves: bool = False


class Outcome(NamedTuple):
    """What an action came to.

    Attributes:
        control: The state after.
        success: Whether it was done.
        text: The answer, for people.
        happened: Name of the decision if something changed for people, else empty.
    """

    control: Control
    success: bool
    text: str
    happened: str = ""


def take(control: Control, seat: Seat, moves: bool, now: float) -> Outcome:
    """Take control while it is free."""
    if control.holder == seat:
        kept = replace(control, seen=now, moves=moves)
        return Outcome(kept, True, f"{seat.name} holds control already")
    if control.holder != NOBODY:
        return Outcome(control, False, held_text(control, now))
    taken = Control(seat, since=now, seen=now, moves=moves)
    return Outcome(taken, True, f"{seat.name} takes control", "CONTROL_TAKEN")


def ask(control: Control, seat: Seat, moves: bool, now: float) -> Outcome:
    """Take control if it is free, else ask its holder; one question at a time."""
    if control.holder in (NOBODY, seat):
        return take(control, seat, moves, now)
    if control.asker == seat:
        again = replace(control, asker_seen=now, asker_moves=moves)
        return Outcome(again, True, f"{control.holder.name} is asked already")
    if control.asker != NOBODY:
        text = f"{control.asker.name} has asked {control.holder.name} before: wait for the answer"
        return Outcome(control, False, text)
    asked = replace(control, asker=seat, asked=now, asker_seen=now, asker_moves=moves)
    text = f"{seat.name} asks {control.holder.name} for control"
    return Outcome(asked, True, text, "CONTROL_ASKED")


def give(control: Control, seat: Seat, now: float) -> Outcome:
    """Hand control over to who asks; only its holder can."""
    if seat != control.holder:
        return Outcome(control, False, f"{seat.name} does not hold control")
    if control.asker == NOBODY:
        return Outcome(control, False, "nobody asks for control: RELEASE gives it up")
    text = f"{seat.name} hands control over to {control.asker.name}"
    return Outcome(_to_asker(control, now), True, text, "CONTROL_GIVEN")


def deny(control: Control, seat: Seat) -> Outcome:
    """Keep control although somebody asks; only its holder can."""
    if seat != control.holder:
        return Outcome(control, False, f"{seat.name} does not hold control")
    if control.asker == NOBODY:
        return Outcome(control, False, "nobody asks for control")
    text = f"{seat.name} keeps control; {control.asker.name} asked for it"
    return Outcome(_no_question(control), True, text, "CONTROL_DENIED")


def release(control: Control, seat: Seat, now: float) -> Outcome:
    """Give control up, to who asks if somebody does; or take a question back."""
    if seat == control.asker and seat != NOBODY:
        text = f"{seat.name} no longer asks for control"
        return Outcome(_no_question(control), True, text, "CONTROL_NOT_ASKED")
    if seat != control.holder:
        return Outcome(control, False, f"{seat.name} does not hold control")
    text = f"{seat.name} releases control{_next_words(control)}"
    return Outcome(_to_asker(control, now), True, text, "CONTROL_RELEASED")


def keep(control: Control, seat: Seat, moves: bool, now: float) -> Outcome:
    """Take a sign of life of the holder or of who asks."""
    if seat == control.asker and seat != NOBODY:
        kept = replace(control, asker_seen=now, asker_moves=moves)
        return Outcome(kept, True, f"{seat.name} asks for control")
    if seat != control.holder:
        return Outcome(control, False, f"{seat.name} does not hold control: TAKE it")
    return Outcome(replace(control, seen=now, moves=moves), True, f"{seat.name} holds control")


def lend(control: Control, local: str, now: float, lend_s: float) -> Outcome:
    """Let a program of this machine move the twin, if it counts as the holder's own.

    Args:
        control: The state before.
        local: The person whose own the program is; empty: nobody's.
        now: Time [s].
        lend_s: So long a motion may begin [s].
    """
    if control.holder == NOBODY:
        return Outcome(control, True, "nobody holds control")
    if not _is_own(control, local):
        return Outcome(control, False, held_text(control, now))
    lent = replace(control, lent=now + lend_s)
    return Outcome(lent, True, f"{control.holder.name} holds control, and this is {local} too")


def end_loan(control: Control, now: float) -> Control:
    """Let the time pass in which a program of this machine may begin a motion of the twin."""
    if control.lent and now > control.lent:
        return replace(control, lent=0.0)
    return control


def heard(control: Control, seat: Seat, now: float) -> Control:
    """Take a command as the sign of life of the holder who sent it."""
    if seat == control.holder != NOBODY:
        return replace(control, seen=now)
    return control


def forgive(control: Control, gap: float) -> Control:
    """Count no silence while the controller itself did not run for ``gap`` [s]."""
    return replace(
        control,
        seen=control.seen + gap,
        asked=control.asked + gap,
        asker_seen=control.asker_seen + gap,
    )


def expire(control: Control, now: float, keep_s: float, answer_s: float) -> Outcome | None:
    """Let time pass: who is silent loses control or the question, who does not answer loses too.

    Args:
        control: The state before.
        now: Time [s].
        keep_s: Without a sign of life for so long a seat counts as gone [s].
        answer_s: Without an answer for so long the asker gets control [s].

    Returns:
        What changed, or None.
    """
    holder, asker = control.holder, control.asker
    if asker != NOBODY and now - control.asker_seen > keep_s:
        text = f"{asker.name}, who asked for control, gives no sign of life"
        return Outcome(_no_question(control), True, text, "CONTROL_NOT_ASKED")
    if holder != NOBODY and now - control.seen > keep_s:
        text = f"{holder.name} gives no sign of life{_next_words(control)}"
        return Outcome(_to_asker(control, now), True, text, "CONTROL_LOST")
    if asker != NOBODY and now - control.asked > answer_s:
        text = f"{holder.name} did not answer{_next_words(control)}"
        return Outcome(_to_asker(control, now), True, text, "CONTROL_LOST")
    return None


def refusal(control: Control, seat: Seat, now: float, local: str = "") -> str:
    """Return why ``seat`` may not begin a motion, or an empty text.

    While nobody holds control a call without a session may: programs and lines in a shell. A page
    or client that says its session takes control first, so that all others see who moves the pair.
    A program without a person that is the holder's own, ``local``, needs no control of its own.
    """
    if control.holder == NOBODY:
        return not_held_text() if seat.session else ""
    if seat == control.holder or (seat == NOBODY and _is_own(control, local)):
        return ""
    return held_text(control, now)


def held_text(control: Control, now: float) -> str:
    """Say who holds control, since when, and what to do."""
    since = f"for {max(0.0, now - control.since):.0f} s"
    return (
        f"{control.holder.name} holds control, {since} now: "
        "ask for it with twin_controller/control, action ASK"
    )


def not_held_text() -> str:
    """Say that nobody holds control, and what to do."""
    return "nobody holds control: take control first"


def others_text(control: Control) -> str:
    """Say for pages why others may not begin a motion; the same while nothing changes."""
    if control.holder == NOBODY:
        return not_held_text()
    return f"{control.holder.name} holds control: ask for it"


def unasked(control: Control) -> bool:
    """Return whether a motion of the twin is that of nobody who may move the pair."""
    return control.holder != NOBODY and not control.moves and not control.lent


def _is_own(control: Control, local: str) -> bool:
    """Return whether a program of this machine is that of the person who holds control."""
    return local != "" and local == control.holder.person


def _to_asker(control: Control, now: float) -> Control:
    """Give control to who asks; nobody asks: it is free."""
    if control.asker == NOBODY:
        return Control()
    return Control(control.asker, since=now, seen=control.asker_seen, moves=control.asker_moves)


def _no_question(control: Control) -> Control:
    return replace(control, asker=NOBODY, asked=0.0, asker_seen=0.0, asker_moves=False)


def _next_words(control: Control) -> str:
    if control.asker == NOBODY:
        return ": control is free"
    return f": control goes to {control.asker.name}"
