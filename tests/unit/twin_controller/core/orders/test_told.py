"""A report from before our last command reached the twin says nothing about who stopped it."""

from __future__ import annotations

import pytest
from harness.pair import SETUP, Pair
from twin_controller.core.actions import Command, Send
from twin_controller.core.events import TwinMotion
from twin_controller.core.lead.effects import send_twin
from twin_controller.core.orders.state import OWN_COMMAND, TwinTold, is_old

SENT, OURS = 100.0, 7
QUIET_S = SETUP.config.twin.stop_quiet_ms * 1e-3


def motion(state: str, command_id: int = OURS) -> TwinMotion:
    """Return a report of the twin's pose controller."""
    return TwinMotion(SENT, state, 50.0, 50.0, 100.0, command_id, False, "")


@pytest.mark.parametrize(
    ("before", "reported", "old"),
    [
        ("moving", "moving", True),
        ("pausing", "paused", True),
        ("paused", "pausing", True),
        ("moving", "paused", False),
        ("paused", "moving", False),
        ("pausing", "stopping", False),
        ("idle", "estopped", False),
    ],
)
def test_a_report_is_old_while_it_says_what_was_so_before(
    before: str, reported: str, old: bool
) -> None:
    """A twin that pauses and one that has paused are the same."""
    told = TwinTold(1, motion(before), SENT)
    assert is_old(SETUP, told, motion(reported), SENT + 0.5 * QUIET_S) is old


def test_a_report_with_another_command_is_new() -> None:
    """Somebody has commanded the twin since."""
    told = TwinTold(1, motion("paused"), SENT)
    assert not is_old(SETUP, told, motion("paused", OURS + 1), SENT)


@pytest.mark.parametrize(("after", "old"), [(0.99 * QUIET_S, True), (1.01 * QUIET_S, False)])
def test_a_report_is_new_when_the_command_must_have_arrived(after: float, old: bool) -> None:
    """stop_quiet_ms after it was sent; and where nothing was known before it."""
    assert is_old(SETUP, TwinTold(1, motion("moving"), SENT), motion("moving"), SENT + after) is old
    assert not is_old(SETUP, TwinTold(1, None, SENT), motion("moving"), SENT + after)


def test_our_commands_are_counted_and_marked_as_ours() -> None:
    """What the twin reports back says which of ours it took last, and that no other node sent it.

    The mark is a bit of its own, above all numbers: a number below 1 would lie over it.
    """
    state, numbers = Pair().state, []
    for _ in range(3):
        state, sent = send_twin(state, Command.PAUSE_TWIN, "test", SENT)
        numbers += [action.id for action in sent if isinstance(action, Send)]
    assert numbers == [OWN_COMMAND + 1, OWN_COMMAND + 2, OWN_COMMAND + 3]
