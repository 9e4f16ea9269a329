"""The rules of standing: nothing moves after a stop, and nothing moves that nobody has sent."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from harness.scenes.truth import Row
from harness.storm.names import BEGINS, WHOLE
from harness.storm.rules.history import SIDES, Decided, Deed, History, Violation
from harness.storm.rules.reading import (
    STILL,
    Motion,
    aligning,
    between,
    first_beyond,
    lives,
    motions,
    ramp,
    reached,
    share,
    stops,
    way,
    without,
)

REACTION_S = {"real": 0.2, "twin": 0.3}
"""So long a side may go on before its ramp begins, as in the battery of faults."""
AMBIGUOUS_S = 0.03
"""What was sent so shortly before a stop may have been heard after it."""
SETTLES = 0.2
"""A side that stands may still settle by this [deg or mm]."""
COUNTS = 0.5
"""A shorter way is no motion [deg or mm]."""
STAMPS_S = 0.005
"""A motion is stamped by the clock of its side, a command by that of who sends it: they agree to
this, and a motion may seem to begin before what moves it."""
LATE_S = 0.1
"""What was sent so shortly before a decision to stop may have been heard after it."""
BEGINS_S = 0.5
"""What has been answered begins no motion later than this."""
STANDS = {"real": ("stall", "halt emulator"), "twin": ("stall", "halt simulator")}
"""Faults in which a side's own process stands still, and its joints with it."""
LEFT_BY = ("ALIGN", *BEGINS)
ENDS_AT_REST = (
    *("MOVE", "MOVE_JOINTS", "HOME", "gateway MOVE", "pose target", "trajectory"),
    *("joint velocity", "joint position", "jog", "gateway jog", "page jog"),
)
"""Commands of one motion that are not answered at its end. A program may wait between two, and what
is resumed may be one."""
STREAMS = ("TWIN_LEADS", "OPERATOR_LEADS")
GONE = "kill twin_controller"
ALWAYS_TAKEN = ("STOP", "ESTOP")
"""Stops that the controller answers at once and takes in every mode: it refuses to PAUSE a stopped
pair, page and gateway may have waited in vain."""
TOO_LATE = "did not answer in time"
"""Part of the answer of a controller that stands still: it has not refused."""
REFUSED, UNANSWERED = "a stop of the pair is refused", "a stop of the pair is not answered"
ENDED = ("OFFLINE", "STOPPED", "STANDSTILL", "PAUSED", "ESTOP", "FAULT")
"""Modes in which the controller says that both stand."""


def moves_after_stop(history: History) -> Iterator[Violation]:
    """No side moves later than its ramp after an acknowledged stop without a new command.

    The robot needs a person's: after a stop of the pair a program that never heard of it may go on
    to command the twin for ever, and the robot stands.
    """
    for stop in history.deeds:
        if not stops(history, stop):
            continue
        for side in stop.sides:
            yield from _moves_after(history, stop, side)


def _moves_after(history: History, stop: Deed, side: str) -> Iterator[Violation]:
    assert stop.answered is not None
    since = reached(history, side, stop.answered)
    for life in lives(history, side):
        allowed = since + REACTION_S[side] + ramp(life, since, history.joints)
        for went, joint, seen in motions_behind(history, stop, side, life, allowed):
            yield Violation(
                "moves after an acknowledged stop",
                seen - LATE_S,
                seen,
                f"{side}: {joint} goes {went:.1f} deg or mm, seen {seen - stop.answered:.2f} s"
                f" after {stop.name} was acknowledged ({stop.said})",
            )


def motions_behind(
    history: History, stop: Deed, side: str, life: Sequence[Row], begin: float
) -> Iterator[tuple[float, str, float]]:
    """Yield what moves from ``begin`` on until something may move the side again.

    How far a joint goes [deg or mm], its name, and when that is seen.
    """
    again = next_command(history, stop, side)
    holes = aligning(history) if side == "twin" else []
    for part in without(life, begin, again, holes):
        went, joint = way(part, history.joints)
        if went > SETTLES:
            yield went, joint, first_beyond(part, SETTLES, history.joints)


def next_command(history: History, stop: Deed, side: str) -> float:
    """Return when something was sent that may move a side again, infinity if nothing was."""
    since = stop.sent - AMBIGUOUS_S
    left = _left(history, stop) if side == "real" and stop.name in WHOLE else since
    sent = [
        max(deed.sent, since if deed.name in BEGINS else left)
        for deed in history.deeds
        if deed.kind == "motion"
        and not deed.refused
        and deed.until >= (since if deed.name in BEGINS else left)
    ]
    return min(sent, default=math.inf)


def _left(history: History, stop: Deed) -> float:
    """Return from when on others than a person may lead the pair again.

    Somebody has aligned it, or resumed it. Or the controller has gone: a new one knows of no stop,
    and aligns the pair by itself.
    """
    since = stop.sent - AMBIGUOUS_S
    left = [d.sent for d in history.deeds if d.name in LEFT_BY and d.sent >= since]
    aligns = ("OFFLINE", "ALIGNING")
    left += [d.at for d in history.decisions if d.at >= since and (d.before, d.after) == aligns]
    left += [s.begun for s in history.strikes if s.ended >= since and GONE in s.name]
    return min(left, default=math.inf)


def stop_not_taken(history: History) -> Iterator[Violation]:
    """Each STOP and ESTOP is taken, and answered, while no fault is in its way."""
    for deed in history.deeds:
        if deed.name not in ALWAYS_TAKEN or deed.acknowledged or _in_the_way(history, deed):
            continue
        late = deed.answered is None or TOO_LATE in deed.said
        end = deed.until if deed.answered is None else deed.answered
        words = f"{deed.name}: {deed.said}" if deed.said else deed.name
        yield Violation(UNANSWERED if late else REFUSED, deed.sent, end, words)


def _in_the_way(history: History, deed: Deed) -> bool:
    """Return whether a fault, or what it leaves behind, falls into the time of a command."""
    until = history.ended if deed.answered is None else deed.answered
    return any(
        strike.begun <= until
        and deed.sent <= strike.ended + max(strike.grace.values(), default=0.0)
        for strike in history.strikes
    )


def moves_by_itself(history: History) -> Iterator[Violation]:
    """No motion begins without a command that is still in force.

    So none begins on a release, a connection that comes back, or RESET.
    """
    aligned = aligning(history)
    for side in SIDES:
        for life in lives(history, side):
            for motion in motions(life, history.joints):
                begin = motion.begin
                if motion.way <= COUNTS or begin - life[0][0] < BEGINS_S:
                    continue
                if side == "twin" and any(a <= begin <= b for a, b in aligned):
                    continue
                if any(in_force(history, deed, side, begin) for deed in history.deeds):
                    continue
                if _is_rest_of_ramp(history, side, life, motion):
                    continue
                if _began_before_it_was_heard(history, side, life, motion):
                    continue
                yield Violation(
                    "moves by itself",
                    begin - LATE_S,
                    begin,
                    f"{side}: {motion.joint} goes {motion.way:.1f} deg or mm within"
                    f" {motion.end - begin:.2f} s; before it: {_last_before(history, begin)}",
                )


def _is_rest_of_ramp(history: History, side: str, life: Sequence[Row], motion: Motion) -> bool:
    """Return whether a motion begins as the rest of a ramp that a stall has cut in two.

    The side's own process stood still while it moved; then it may go on until it has heard of the
    stop, and for a ramp. What moves it after that must be in force, as for any other motion.
    """
    for strike in history.strikes:
        if not strike.name.startswith(STANDS[side]):
            continue
        if not strike.begun <= motion.begin <= strike.ended + AMBIGUOUS_S:
            continue
        before = between(life, strike.begun - LATE_S, strike.begun)
        if not before or share(before[-1], history.joints) <= STILL:
            continue
        stands = strike.ended + REACTION_S[side] + ramp(life, strike.begun, history.joints)
        return _ends_by(history, side, motion, stands)
    return False


def _began_before_it_was_heard(
    history: History, side: str, life: Sequence[Row], motion: Motion
) -> bool:
    """Return whether a motion was due when the controller decided that both stand.

    A move that was announced begins all the same until its side has heard of the decision; then it
    is on its ramp. A robot whose line is lost hears nothing: its program goes on to its next motion
    until its watchdog ends it.
    """
    for decision in history.decisions:
        cut_off = side == "real" and decision.event == "LINK_LOST" and "(real:" in decision.why
        until = decision.at + (REACTION_S[side] if cut_off else AMBIGUOUS_S)
        if not _ends_motion(decision) or not decision.at <= motion.begin <= until:
            continue
        if not any(in_force(history, deed, side, decision.at) for deed in history.deeds):
            continue
        heard = decision.at + REACTION_S[side]
        under_way = between(life, motion.begin, heard)
        slows = max((ramp(life, row[0], history.joints) for row in under_way), default=0.0)
        return _ends_by(history, side, motion, heard + slows)
    return False


def _ends_by(history: History, side: str, motion: Motion, stands: float) -> bool:
    """Return whether a motion ends by ``stands``, or goes over into one that is in force then."""
    if motion.end <= stands or any(in_force(history, deed, side, stands) for deed in history.deeds):
        return True
    return side == "twin" and any(a <= stands <= b for a, b in aligning(history))


def _ends_motion(decision: Decided) -> bool:
    """Return whether the controller says with it that both stand from now on."""
    return decision.after in ENDED and decision.before != decision.after


def in_force(history: History, deed: Deed, side: str, at: float) -> bool:
    """Return whether a command may begin a motion of a side at ``at``.

    It was sent, not refused, has not come to its end, and nothing that can have reached the side
    has ended it since. A robot without its link stops by itself, a twin does not.
    """
    if deed.kind != "motion" or deed.sent > at + STAMPS_S:
        return False
    over = deed.waits or not deed.success
    if over and deed.answered is not None and at > deed.answered + BEGINS_S:
        return False
    if deed.name in ENDS_AT_REST and _has_rested(history, deed, at):
        return False
    stopped = any(
        stop.sent > deed.until + AMBIGUOUS_S and (stop.answered or at) < at and stops(history, stop)
        for stop in history.deeds
    )
    decided = any(
        _ends_motion(decision)
        and deed.until + LATE_S < decision.at
        and (decision.at if side == "real" else reached(history, side, decision.at)) < at
        for decision in history.decisions
    )
    return not stopped and not decided


def _has_rested(history: History, deed: Deed, at: float) -> bool:
    """Return whether the pair has come to rest between a command and ``at``.

    What waited in a node that stood still had not begun before.
    """
    faults = [strike.ended for strike in history.strikes if strike.begun <= deed.until + LATE_S]
    heard = max([deed.answered or deed.until, *faults])
    return any(
        decision.before in STREAMS
        and decision.after == "IDLE"
        and heard < decision.at < at - BEGINS_S
        for decision in history.decisions
    )


def _last_before(history: History, at: float) -> str:
    """Name the last that was done to the pair before ``at``."""
    done = [(deed.sent, deed.name) for deed in history.deeds if deed.sent <= at]
    done += [(strike.ended, f"end of {strike.name}") for strike in history.strikes]
    done = [(when, name) for when, name in done if when <= at]
    if not done:
        return "nothing"
    when, name = max(done)
    return f"{name}, {at - when:.2f} s ago"
