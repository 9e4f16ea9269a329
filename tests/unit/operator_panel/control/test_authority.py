"""The page shows what the twin controller says of who may command, and lets go by itself."""

from __future__ import annotations

import pytest
from operator_panel.control.authority import AT_REST, Role, command_refusal, lets_go, refusal
from operator_panel.view.snapshot import CellState
from scara_ros.page.page_words import MODES
from twin_controller.core.lead.modes import Mode

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


def test_modes_of_the_page_are_those_of_the_controller() -> None:
    """None is shown as a mere code."""
    assert set(MODES) == {mode.value for mode in Mode}


@pytest.mark.parametrize(
    ("command", "silent", "why"),
    [
        ("PAUSE", False, "nothing moves"),
        ("HOME", False, ""),
        ("MOVE", False, "the twin controller does not know this command"),
        *[(one, True, "the twin controller is silent") for one in ("PAUSE", "HOME", "JOG")],
    ],
)
def test_button_says_what_the_controller_says(command: str, silent: bool, why: str) -> None:
    """Its own reason; what it has not said, or said a while ago, is promised by nobody."""
    assert command_refusal(command, {"PAUSE": "nothing moves", "HOME": ""}, silent) == why
