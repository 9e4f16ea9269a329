"""The rule of stalls: what waited in a node when a stop was given never moves anything."""

from __future__ import annotations

from collections.abc import Iterator

from harness.storm.names import THROUGH
from harness.storm.rules.history import Deed, History, Strike, Violation
from harness.storm.rules.reading import REST_S, STILL, between, lives, share
from harness.storm.rules.stops import AMBIGUOUS_S, in_force, motions_behind


def replayed(history: History) -> Iterator[Violation]:
    """Nothing moves by a request that waited in a node together with a stop that came later.

    Its sides stood before, so that no reaction, no ramp and no line that is made again excuses a
    motion.
    """
    for strike in history.strikes:
        for request, stop in inside(history, strike):
            for side in stop.sides:
                yield from _moves(history, strike, request, stop, side)


def inside(history: History, strike: Strike) -> Iterator[tuple[Deed, Deed]]:
    """Yield each request that waits in a node, with the first stop that comes behind it."""
    kind, _, words = strike.name.partition(" ")
    if kind != "halt":
        return
    ways = THROUGH.get(words.split()[0], ())
    meanwhile = [d for d in history.deeds if strike.begun <= d.sent and d.until <= strike.ended]
    for request in meanwhile:
        if request.name not in ways:
            continue
        later = [
            deed
            for deed in meanwhile
            if deed.kind == "stop" and deed.acknowledged and deed.sent > request.until + AMBIGUOUS_S
        ]
        if later:
            yield request, min(later, key=lambda deed: deed.sent)


def _moves(
    history: History, strike: Strike, request: Deed, stop: Deed, side: str
) -> Iterator[Violation]:
    if _others(history, strike, request, stop, side):
        return
    for life in lives(history, side):
        stood = between(life, strike.begun - REST_S, strike.begun)
        if not stood or max(share(row, history.joints) for row in stood) > STILL:
            continue
        for went, joint, seen in motions_behind(history, stop, side, life, strike.begun):
            yield Violation(
                "a request from before a stop is done behind a stall",
                request.sent,
                seen,
                f"{side}: {joint} goes {went:.1f} deg or mm by {request.name} from before"
                f" {stop.name}, both given during {strike.name}",
            )


def _others(history: History, strike: Strike, request: Deed, stop: Deed, side: str) -> bool:
    """Return whether another command may move a side until the stop."""
    return any(
        deed is not request
        and not deed.refused
        and (
            in_force(history, deed, side, strike.begun)
            or (deed.kind == "motion" and strike.begun <= deed.until and deed.sent <= stop.sent)
        )
        for deed in history.deeds
    )
