"""What the commands of the state table become."""

from __future__ import annotations

import pytest
from harness.pair import SETUP, idle_pair
from twin_controller.core.actions import Command, MoveTwin, Send, SendReal, SendTwin
from twin_controller.core.events import Operator
from twin_controller.core.lead.effects import carry_out


@pytest.mark.parametrize("command", list(Command))
def test_what_is_sent_goes_to_the_side_that_the_command_names(command: Command) -> None:
    """The shell routes by the action's type alone."""
    pair = idle_pair()
    asked = Operator(pair.now, "HOME")
    _, actions = carry_out(SETUP, pair.state, command, "because", pair.now, asked)
    sent = [action for action in actions if isinstance(action, Send)]
    side = SendTwin if command.name.endswith("_TWIN") else SendReal
    assert [type(action) for action in sent] == [side] * len(sent)
    inner = command.name.startswith("BEGIN_") or command in (Command.BASELINE, Command.START_STREAM)
    assert bool(sent) != (inner or any(isinstance(action, MoveTwin) for action in actions))
