"""What a storm has really done: one whose own acts had no effect has shown nothing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from harness.storm.names import DEAF, WHOLE
from harness.storm.rules.history import SIDES, Deed, History
from harness.storm.rules.pair import STRANGERS, held
from harness.storm.rules.reading import between, lives, way
from harness.storm.rules.stops import ENDED, LATE_S, SETTLES, next_command

MOVES_S = 1.0
"""A command that is accepted moves a side within this."""


class Effect(NamedTuple):
    """What must happen at least once in each scene that opens so, or in any, or with a fault."""

    name: str
    played: str
    count: Callable[[History], int]


def _moving(history: History) -> int:
    return sum(_moves(history, deed) for deed in history.deeds if deed.kind == "motion")


def _moves(history: History, deed: Deed) -> bool:
    """Return whether a side moves soon after a command."""
    for side in SIDES:
        for life in lives(history, side):
            rows = between(life, deed.sent, deed.until + MOVES_S)
            if way(rows, history.joints)[0] > SETTLES:
                return True
    return False


def _obeyed(history: History) -> int:
    """Count the stops with which the controller has changed its mode to one that stands."""
    return sum(
        any(
            deed.sent - LATE_S < d.at < (deed.answered or deed.until) + LATE_S
            for d in history.decisions
            if d.after in ENDED and d.before != d.after
        )
        for deed in history.deeds
        if deed.name in WHOLE and deed.acknowledged
    )


def _struck(history: History) -> int:
    return sum(strike.seen for strike in history.strikes)


def _stalled(history: History) -> int:
    """Count the stalls of a node with a request and a stop in them."""
    return sum(
        any(strike.begun < d.sent < strike.ended and d.kind == "motion" for d in history.deeds)
        and any(strike.begun < d.sent < strike.ended and d.name in WHOLE for d in history.deeds)
        for strike in history.strikes
        if strike.name.startswith("halt") and strike.seen
    )


def _jogged(history: History) -> int:
    """Count the jogs of a page that held control, with which a side moved."""
    jogs = [deed for deed in history.deeds if deed.name == "page jog"]
    return sum(_moves(history, deed) and _holds(history, deed) for deed in jogs)


def _holds(history: History, deed: Deed) -> bool:
    return any(s.holder for s in history.states if deed.sent < s.at < deed.until + LATE_S)


def _refused(history: History) -> int:
    """Count the commands of strangers that were refused beside who holds control."""
    return sum(
        deed.name in STRANGERS
        and deed.answered is not None
        and not deed.success
        and bool(held(history, deed))
        and "holds control" in deed.said
        for deed in history.deeds
    )


def _deaf(history: History) -> int:
    """Count the commands of programs to a pair that was stopped before."""
    stops = [deed for deed in history.deeds if deed.name in WHOLE and deed.acknowledged]
    return sum(
        any(
            stop.answered < deed.sent < next_command(history, stop, "real")
            for stop in stops
            if stop.answered is not None
        )
        for deed in history.deeds
        if deed.name in DEAF
    )


def _seen(history: History, side: str) -> int:
    """Return whether each life of a side has shown where it is: 1, or less."""
    return len(lives(history, side)) - len(history.births.get(side, ()))


EFFECTS = (
    Effect("the truth of the robot is heard", "any", partial(_seen, side="real")),
    Effect("the truth of the twin is heard", "any", partial(_seen, side="twin")),
    Effect("a command moves a side", "any", _moving),
    Effect("a stop of the pair is obeyed", "any", _obeyed),
    Effect("a fault breaks what it shall", "struck", _struck),
    Effect("a request and a stop in one stall", "stalled", _stalled),
    Effect("the page jogs and holds control", "page", _jogged),
    Effect("a stranger is refused beside the holder", "page", _refused),
    Effect("a program goes on behind a stop", "deaf", _deaf),
)
