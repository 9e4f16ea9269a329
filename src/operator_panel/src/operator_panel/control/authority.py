"""What the twin controller says of who may command; the page has no rules of its own."""

from __future__ import annotations

from collections.abc import Mapping

from scara_config.text_enum import StrEnum

from operator_panel.view.snapshot import CellState
from scara_msgs.msg import TwinControllerState as Mode

ENDING = ("STOP", "PAUSE", "ESTOP", "STANDSTILL")
"""Whoever sees the page may end a motion."""
AT_REST = (Mode.IDLE, Mode.STOPPED, Mode.STANDSTILL, Mode.ESTOP, Mode.FAULT, Mode.OFFLINE)
"""In the other modes a motion or a program runs, or waits to go on."""


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
    # Who commands while nobody holds control takes it by that.
    return state.not_in_control if state.holder not in ("", name) else ""


def lets_go(state: CellState, idle_s: float, let_go_s: float) -> bool:
    """Return whether a holder lets go of control.

    Args:
        state: What the twin controller has said.
        idle_s: So long ago it has commanded, or its motion has ended [s].
        let_go_s: After so long it lets go [s].
    """
    return idle_s > let_go_s and state.mode in AT_REST


def command_refusal(command: str, refused: Mapping[str, str], silent: bool) -> str:
    """Return why a button is greyed out now, or an empty text; STOP and E-STOP never are.

    Args:
        command: A command of the operator, or JOG, or RUN (a program of the real robot).
        refused: What the twin controller said of each command; an empty text: allowed.
        silent: Whether the twin controller says nothing.
    """
    if silent:
        return "the twin controller is silent"
    return refused.get(command, "the twin controller does not know this command")
