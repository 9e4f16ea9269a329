"""The rules of the pair: one leader, together while IDLE, an author for each motion, a way back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from harness.scenes.truth import Row, tool_and_elbow
from harness.storm.names import DEAF
from harness.storm.rules.history import SIDES, Decided, Deed, History, Told, Violation
from harness.storm.rules.reading import between, lives, motions

LEADERS = {"REAL_LEADS": "real", "TWIN_LEADS": "twin", "OPERATOR_LEADS": "operator"}
FIGHT_S = 2.0
"""Leaders that change to and fro within this fight for the lead."""
APART_MM, APART_DEG = 3.0, 0.5
"""More than the largest difference at rest that the pair allows itself: 2 mm at the tool."""
LASTS_S = 0.3
"""A pair that has been apart for less may just be about to decide."""
SILENT_S = 0.2
"""After so long without a state nothing is known of the mode."""
COUNTS = 1.0
"""A motion of less [deg or mm] needs no author."""
BEFORE_S, AFTER_S = 1.0, 0.5
"""An author is named so long before or after the motion's begin."""
NAMED = "TWIN_MOVED_STOPPED"
"""Names a program that moves a stopped twin, once in a stop: until STOP comes again, or it ends."""
SENDS_S = 1.2
"""A program that goes on sends again within this: the slowest of a storm does each second."""
BLIND_S = 1.0
"""So long around a fault the controller may not see what moves."""
STRANGERS = ("gateway MOVE",)
"""Commands of clients without a person."""
REFUSALS = ("STOP", "PAUSE", "RESET", "ACKNOWLEDGE", "LINK_LOST", "LINKS_READY")
"""Decisions on these are no author of a motion."""


def two_leaders(history: History) -> Iterator[Violation]:
    """Exactly one leads: mode and leader agree, and nobody fights for the lead."""
    for decision in history.decisions:
        if decision.leader != LEADERS.get(decision.after, decision.leader):
            text = f"{decision.after} with the leader {decision.leader!r}: {decision.why}"
            yield Violation("two leaders", decision.at, decision.at, text)
    led = [d for d in history.decisions if d.leader and d.before != d.after]
    for first, second, third in zip(led, led[1:], led[2:]):
        if not _fights(first, second, third):
            continue
        moves = [d.until for d in history.deeds if d.kind == "motion" and not d.refused]
        if any(first.at < until < third.at for until in moves):
            continue
        text = f"{first.leader}, {second.leader}, {third.leader} lead within {FIGHT_S:g} s"
        yield Violation("two leaders", first.at, third.at, text)


def _fights(first: Decided, second: Decided, third: Decided) -> bool:
    changes = first.leader == third.leader != second.leader
    return changes and third.at - first.at < FIGHT_S


def apart_while_idle(history: History) -> Iterator[Violation]:
    """A pair that says that it is IDLE is together."""
    run: list[tuple[Told, str]] = []
    for before, now in pairwise([*history.states, None]):
        if before is None:
            continue
        text = _apart(history, before.at) if before.mode == "IDLE" else ""
        if text:
            run.append((before, text))
        if run and (not text or now is None or now.at - before.at > SILENT_S):
            if run[-1][0].at - run[0][0].at > LASTS_S:
                begin, end = run[0][0].at, run[-1][0].at
                yield Violation(
                    "apart while IDLE", begin, end, f"{run[-1][1]}, for {end - begin:.2f} s"
                )
            run = []


def _apart(history: History, at: float) -> str:
    """Say how far the sides are apart at ``at``, empty if they are together or one is unknown."""
    poses = [_newest(history, side, at) for side in SIDES]
    if poses[0] is None or poses[1] is None:
        return ""
    real, twin = poses[0][1], poses[1][1]
    tools = 1e3 * math.dist(tool_and_elbow(real)[0], tool_and_elbow(twin)[0])
    table = math.degrees(abs(real[3] - twin[3]))
    if tools <= APART_MM and table <= APART_DEG:
        return ""
    return f"tools {tools:.1f} mm, tables {table:.2f} deg apart"


def _newest(history: History, side: str, at: float) -> Row | None:
    rows = between(history.truth[side], at - SILENT_S, at)
    return rows[-1] if rows else None


def without_author(history: History) -> Iterator[Violation]:
    """Each motion that the controller can see has an author in its decisions or the audit."""
    for side in SIDES:
        for life in lives(history, side):
            for motion in motions(life, history.joints):
                at = motion.begin
                if motion.way <= COUNTS or _blind(history, at) or _author(history, at):
                    continue
                if side == "twin" and _sends_on(history, at):
                    continue
                yield Violation(
                    "a motion without an author",
                    at,
                    at + AFTER_S,
                    f"{side}: {motion.joint} goes {motion.way:.1f} deg or mm in mode"
                    f" {_mode(history, at)}, and neither a decision nor the audit says why",
                )


def _blind(history: History, at: float) -> bool:
    """Return whether a fault or a lost link keeps the controller from seeing what moves."""
    struck = any(s.begun - AFTER_S < at < s.ended + BLIND_S for s in history.strikes)
    mode = _mode(history, at)
    return struck or mode in ("", "OFFLINE") or _mode(history, at + AFTER_S) == "OFFLINE"


def _mode(history: History, at: float) -> str:
    told = [state.mode for state in history.states if at - SILENT_S < state.at <= at]
    return told[-1] if told else ""


def _author(history: History, at: float) -> bool:
    begin, end = at - BEFORE_S, at + AFTER_S
    if any(state.leader for state in history.states if at <= state.at <= end):
        return True
    decided = (d for d in history.decisions if begin <= d.at <= end)
    if any(d.event not in REFUSALS or d.after == "ALIGNING" for d in decided):
        return True
    entries = (e for e in history.audit if begin <= e.at <= end)
    return any(e.success and not e.what.startswith(REFUSALS) for e in entries)


def _sends_on(history: History, at: float) -> bool:
    """Return whether the program that was named in this stop has sent until a motion's begin.

    It is the author of what it sent without a longer gap since, and of nothing else: neither of
    what another program moves, nor of what moves after it has ended.
    """
    decided = [d for d in history.decisions if d.at <= at]
    edges = [d for d in decided if d.after != "STOPPED" or d.event in ("STOP", NAMED)]
    if not edges or edges[-1].event != NAMED:
        return False
    named = edges[-1].at
    sent = [d for d in history.deeds if d.name in DEAF and named - BEFORE_S <= d.sent <= at]
    before = [deed for deed in sent if deed.sent <= named]
    if not before:
        return False
    source = max(before, key=lambda deed: deed.sent)
    own = sorted((d.sent, d.until) for d in sent if d.name == source.name and d.sent >= source.sent)
    ends = [until for _, until in own]
    return all(later - end <= SENDS_S for later, end in zip([*(a for a, _ in own[1:]), at], ends))


def not_idle_again(history: History) -> Iterator[Violation]:
    """RESET and ALIGN lead back to IDLE."""
    if history.unrecovered:
        yield Violation("not IDLE again", history.ended, history.ended, history.unrecovered)


def stranger_commands(history: History) -> Iterator[Violation]:
    """While somebody holds control, no stranger's command begins a motion."""
    for deed in history.deeds:
        if deed.name in STRANGERS and deed.acknowledged and held(history, deed):
            text = f"{deed.name} was answered with yes: {deed.said}"
            yield Violation("a stranger commands beside the holder", deed.sent, deed.sent, text)


def held(history: History, deed: Deed) -> str:
    """Return who held control from before a command until its answer, empty if nobody did."""
    end = deed.sent if deed.answered is None else deed.answered
    told = [s.holder for s in history.states if deed.sent - SILENT_S < s.at <= end]
    return told[0] if told and len(set(told)) == 1 else ""


def dead_node(history: History) -> Iterator[Violation]:
    """No node dies that we have not killed."""
    for text in history.deaths:
        yield Violation("a node has died", history.begun, history.ended, text)
