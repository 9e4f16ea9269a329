"""A report from before our last command reached the twin says nothing about who stopped it."""

from __future__ import annotations

import pytest
from harness.pair import SETUP
from twin_controller.core.events import TwinMotion
from twin_controller.core.orders.state import TwinTold, is_old

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
