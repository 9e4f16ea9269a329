"""Which buttons are enabled when: those whose command the twin controller does not refuse."""

from __future__ import annotations

import pytest
from operator_panel.control.authority import command_refusal
from scara_ros.page.page_words import MODES
from twin_controller.core.lead.modes import Mode

REFUSED = {"PAUSE": "nothing moves", "HOME": ""}


def test_modes_of_the_page_are_those_of_the_controller() -> None:
    """None is shown as a mere code."""
    assert set(MODES) == {mode.value for mode in Mode}


@pytest.mark.parametrize("command", ["PAUSE", "HOME"])
def test_button_says_what_the_controller_says(command: str) -> None:
    """Allowed or not, with the controller's own reason."""
    assert command_refusal(command, REFUSED, False) == REFUSED[command]


def test_command_that_the_controller_does_not_name_is_greyed_out() -> None:
    """The page promises nothing that the controller has not said."""
    assert "does not know" in command_refusal("MOVE", REFUSED, False)


@pytest.mark.parametrize("command", ["PAUSE", "HOME", "SPEED", "JOG"])
def test_silent_controller_greys_out_everything_else(command: str) -> None:
    """What is shown may be old."""
    assert command_refusal(command, REFUSED, True) == "the twin controller is silent"
