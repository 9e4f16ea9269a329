"""What the commands of the state table become."""

from __future__ import annotations

import pytest
from harness.pair import HOME, SETUP, idle_pair, ramp, shifted
from harness.parts import changed
from twin_controller.core.actions import Command, MoveTwin, Send, SendReal, SendTwin
from twin_controller.core.events import Operator
from twin_controller.core.lead.effects import carry_out, send_twin
from twin_controller.core.lead.modes import Mode


@pytest.mark.parametrize("stopped_ago", [1e-3, 1e3])
@pytest.mark.parametrize("command", [Command.BEGIN_ALIGN, Command.BEGIN_FOLLOW_TWIN])
def test_a_twin_aligns_slowly_and_follows_at_once(command: Command, stopped_ago: float) -> None:
    """Neither before it listens again after a stop."""
    pair, quiet_s = idle_pair(), SETUP.config.twin.stop_quiet_ms * 1e-3
    before = changed(pair.state, follow__twin_stopped_at=pair.now - stopped_ago)
    state, sent = carry_out(SETUP, before, command, "because", pair.now, None)
    follows = state.follow.twin
    assert follows is not None and sent == []
    assert follows.slowly is (command is Command.BEGIN_ALIGN)
    assert follows.since == pytest.approx(pair.now + max(0.0, quiet_s - stopped_ago))


@pytest.mark.parametrize("command", [each for each in Command if each.name.endswith("_TWIN")])
def test_a_twin_that_is_stopped_has_no_plan_any_more(command: Command) -> None:
    """One that pauses goes on by it, and one that goes on has it still."""
    pair = idle_pair()
    pair.move_twin(ramp(HOME, shifted(HOME, 40.0), 3.0), run=1.0)
    assert pair.state.sides.twin.plan is not None
    state, _ = send_twin(pair.state, command, "because", pair.now)
    ends = command in (Command.STOP_TWIN, Command.ESTOP_TWIN, Command.YIELD_TWIN)
    assert (state.sides.twin.plan is None) is ends
    bars = command in (Command.STOP_TWIN, Command.ESTOP_TWIN)
    assert (state.follow.twin_stopped_at == pair.now) is bars


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


def test_what_must_be_aligned_stays_so_until_it_is_aligned() -> None:
    """A reset makes it so: no line that is lost forgets it, however close both sides stand."""
    pair = idle_pair()
    for command in ("ESTOP", "RESET"):
        assert pair.operate(command).success
        pair.run(1.0)
    for connected in (False, True):
        pair.link("twin", connected)
        pair.run(1.0)
        assert pair.state.lead.must_align
    assert pair.operate("ALIGN").success
    pair.until(Mode.IDLE)
    assert not pair.state.lead.must_align
