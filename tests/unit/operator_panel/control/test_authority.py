"""The page shows what the twin controller says of who may command, and lets go by itself."""

from __future__ import annotations

import pytest
from operator_panel.control.authority import AT_REST, Role, lets_go, refusal
from operator_panel.view.snapshot import CellState
from scara_ros.page.page_words import MODES

STATE = CellState("IDLE", holder="fitter 1", not_in_control="fitter 1 holds control: ask for it")
FREE = CellState("IDLE", not_in_control="nobody holds control: take control first")


@pytest.mark.parametrize(
    ("state", "name", "role", "why"),
    [
        (STATE, "fitter 1", Role.OPERATOR, ""),
        (STATE, "fitter 2", Role.OPERATOR, "fitter 1 holds control: ask for it"),
        (FREE, "fitter 1", Role.OPERATOR, ""),
        (STATE, "viewer", Role.VIEWER, "only watches"),
        (None, "fitter 1", Role.OPERATOR, "silent"),
    ],
)
def test_who_may_command_is_what_the_twin_controller_says(
    state: CellState | None, name: str, role: Role, why: str
) -> None:
    """Only the words for a viewer are the page's: nobody else knows who has no token."""
    text = refusal(role, name, state)
    assert why in text and bool(text) == bool(why)


@pytest.mark.parametrize("mode", MODES)
def test_nobody_lets_go_while_something_runs_or_waits_to_go_on(mode: str) -> None:
    """Every mode of the twin controller is one or the other."""
    state = CellState(mode, holder="fitter 1")
    runs = mode in ("ALIGNING", "REAL_LEADS", "TWIN_LEADS", "OPERATOR_LEADS", "PAUSED")
    assert lets_go(state, 30.1, 30.0) == (not runs) == (mode in AT_REST)
    assert not lets_go(state, 30.0, 30.0)
