"""The page shows what the twin controller says of who may command; it has no rule of its own."""

from __future__ import annotations

import pytest
from operator_panel.control.authority import Role, refusal
from operator_panel.view.snapshot import CellState

STATE = CellState("IDLE", holder="fitter 1", not_in_control="fitter 1 holds control: ask for it")
FREE = CellState("IDLE", not_in_control="nobody holds control: take control first")


@pytest.mark.parametrize(
    ("state", "name", "role", "why"),
    [
        (STATE, "fitter 1", Role.OPERATOR, ""),
        (STATE, "fitter 2", Role.OPERATOR, "fitter 1 holds control: ask for it"),
        (FREE, "fitter 1", Role.OPERATOR, "take control first"),
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
