"""Say an event of the journal in one line, and whether it stopped the pair; pure."""

from __future__ import annotations

from typing import Any

from scara_msgs.msg import TwinControllerState

LATCHED = frozenset(
    {
        TwinControllerState.STANDSTILL,
        TwinControllerState.ESTOP,
        TwinControllerState.FAULT,
        TwinControllerState.OFFLINE,
    }
)
"""From these into STOPPED is a step on the way out: RESET, or links that are up again."""
STOPS = LATCHED | {TwinControllerState.STOPPED, TwinControllerState.PAUSED}
"""Modes in which the pair does not go on by itself."""
LONGEST = 300
"""Our choice: signs of a line; the whole event is beside it."""


def describe(kind: str, body: dict[str, Any]) -> tuple[bool, str]:
    """Return whether an event stopped the pair, and the event in words.

    Args:
        kind: Of the journal's line.
        body: All of the line; what it lacks is left out.
    """
    text = _TEXTS.get(kind, _other)(body)
    before, after = body.get("mode_before"), body.get("mode_after")
    on_the_way_out = before in LATCHED and after == TwinControllerState.STOPPED
    stop = kind == "decision" and after in STOPS and before != after and not on_the_way_out
    # On one line, whatever stands in the journal.
    return stop, " ".join(text.split())[:LONGEST]


def _decision(body: dict[str, Any]) -> str:
    who = f", asked for by {body['who']}" if body.get("who") else ""
    return (
        f"{body.get('mode_before', '')} -> {body.get('mode_after', '')}: {body.get('why', '')}{who}"
    )


def _audit(body: dict[str, Any]) -> str:
    done = "" if body.get("success") else "refused: "
    return f"{body.get('who', '')}: {body.get('what', '')}: {done}{body.get('outcome', '')}"


def _alarm(body: dict[str, Any]) -> str:
    ended = "" if body.get("active", True) else "cleared: "
    return f"{ended}{body.get('source', '')}: {body.get('text', '')}"


def _cycle(body: dict[str, Any]) -> str:
    seconds = float(body.get("end") or 0.0) - float(body.get("start") or 0.0)
    error = body.get("worst_error_mm")
    worst = "" if error is None else f", worst error {error:.2f} mm"
    why = f": {body['why']}" if body.get("why") else ""
    name = body.get("program") or body.get("leader") or "cycle"
    return f"{name}: {body.get('outcome', '')} after {seconds:.1f} s{worst}{why}"


def _exercise(body: dict[str, Any]) -> str:
    done = "passed" if body.get("passed") else "not yet"
    return f"{body.get('learner', '')}: {body.get('title', '')}: {done}: {body.get('reason', '')}"


def _other(body: dict[str, Any]) -> str:
    shown = (f"{key} {value}" for key, value in body.items() if key not in _USUAL)
    return ", ".join(shown)


_USUAL = ("number", "time", "kind", "cell")
_TEXTS = {
    "decision": _decision,
    "audit": _audit,
    "alarm": _alarm,
    "cycle": _cycle,
    "exercise": _exercise,
}
