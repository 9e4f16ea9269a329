"""Which buttons are enabled when; the twin controller's own table is the measure."""

from __future__ import annotations

import pytest
from operator_panel.control.commands import COMMANDS, refusal
from operator_panel.view.words import MODES
from twin_controller.core.rules.table import Mode, Trigger, look_up

PAUSED_BY = Mode.REAL_LEADS


def test_modes_of_the_page_are_those_of_the_controller() -> None:
    """None is shown as a mere code."""
    assert set(MODES) == {mode.value for mode in Mode}


@pytest.mark.parametrize("mode", [mode.value for mode in Mode])
@pytest.mark.parametrize("command", ["STOP", "ESTOP"])
def test_stops_are_never_greyed_out(command: str, mode: str) -> None:
    """Not even while the controller is silent."""
    assert refusal(command, mode, False, True) == refusal(command, mode, True, False) == ""


@pytest.mark.parametrize("mode", list(Mode), ids=str)
@pytest.mark.parametrize("command", ["PAUSE", "RESUME", "RESET", "ALIGN", "MOVE"])
def test_enabled_button_is_one_that_the_controller_would_obey(command: str, mode: Mode) -> None:
    """The page promises nothing that the table refuses."""
    if refusal(command, mode.value, False, False) == "":
        assert not look_up(mode, Trigger[command], PAUSED_BY).refused


@pytest.mark.parametrize(
    ("command", "mode"), [("PAUSE", "REAL_LEADS"), ("RESUME", "PAUSED"), ("RESET", "ESTOP"), ("MOVE", "IDLE")]
)
def test_button_is_enabled_where_it_is_needed(command: str, mode: str) -> None:
    """Greying out everything would pass the test above."""
    assert refusal(command, mode, False, False) == ""


def test_acknowledge_is_offered_once_the_pair_came_apart() -> None:
    """And while paused, since the divergence may have gone meanwhile."""
    assert refusal("ACKNOWLEDGE", "IDLE", False, False) != ""
    assert refusal("ACKNOWLEDGE", "PAUSED", False, False) == refusal("ACKNOWLEDGE", "IDLE", True, False) == ""


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - {"STOP", "ESTOP"}))
def test_silent_controller_greys_out_everything_else(command: str) -> None:
    """What is shown may be old."""
    assert refusal(command, "IDLE", False, True) == "the twin controller is silent"


@pytest.mark.parametrize(("mode", "allowed"), [("IDLE", True), ("TWIN_LEADS", True), ("REAL_LEADS", False), ("ESTOP", False)])
def test_jog_goes_on_while_the_twin_leads_by_it(mode: str, allowed: bool) -> None:
    """Jogging makes the twin the leader; that must not end the jog."""
    assert (refusal("JOG", mode, False, False) == "") == allowed
