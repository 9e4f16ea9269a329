"""What the twin controller says of who may command; the page has no rules of its own."""

from __future__ import annotations

from scara_config.text_enum import StrEnum

from operator_panel.view.snapshot import CellState

ENDING = ("STOP", "PAUSE", "ESTOP")
"""Whoever sees the page may end a motion."""


class Role(StrEnum):
    """What a page may do at all."""

    OPERATOR = "operator"
    VIEWER = "viewer"


def refusal(role: Role, name: str, state: CellState | None) -> str:
    """Return why a page may not begin a motion now, or an empty text.

    Args:
        role: Whether its visitor has brought a token.
        name: Person and session, as the twin controller names the holder.
        state: What the twin controller has said.
    """
    if role is not Role.OPERATOR:
        return "this page only watches: open the operator's address, the one with a token"
    if state is None:
        return "the twin controller is silent"
    return "" if state.holder == name else state.not_in_control
