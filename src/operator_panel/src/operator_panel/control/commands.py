"""What the twin controller says of each command; the page has no rules of its own."""

from __future__ import annotations

from collections.abc import Mapping


def refusal(command: str, refused: Mapping[str, str], silent: bool) -> str:
    """Return why a button is greyed out now, or an empty text; STOP and E-STOP never are.

    Args:
        command: A command of the operator, or JOG, or RUN (a program of the real robot).
        refused: What the twin controller said of each command; an empty text: allowed.
        silent: Whether the twin controller says nothing.
    """
    if silent:
        return "the twin controller is silent"
    return refused.get(command, "the twin controller does not know this command")
