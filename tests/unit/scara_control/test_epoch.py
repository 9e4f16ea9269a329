"""What was asked for before a stop never begins after it."""

from __future__ import annotations

import pytest
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.epoch import STALL_S, WAITING_S, Epoch

PERIOD = 0.01


def run(epoch: Epoch, begin: float, seconds: float) -> float:
    """Let a node run for a while; return the time after it."""
    for k in range(round(seconds / PERIOD)):
        epoch.ran(begin + k * PERIOD)
    return begin + seconds


@pytest.mark.parametrize("command", [Command.STOP, Command.ESTOP, Command.PAUSE])
def test_a_request_that_waited_through_a_stop_is_refused(command: Command) -> None:
    """It may have waited for a service, or for an older motion to end."""
    epoch = Epoch(0.0)
    now = run(epoch, 0.0, 1.0)
    number = epoch.begin(now)
    epoch.check(number)
    epoch.hear(command, "by the operator")
    with pytest.raises(
        MotionRefusedError, match=f"^cancelled by {command.name}: by the operator, before it began$"
    ):
        epoch.check(number)
    epoch.check(epoch.begin(now))


@pytest.mark.parametrize("command", [Command.RESUME, Command.RESET])
def test_what_stops_nothing_ends_no_epoch(command: Command) -> None:
    """A release moves nothing and refuses nothing."""
    epoch = Epoch(0.0)
    number = epoch.begin(0.0)
    epoch.hear(command, "")
    epoch.check(number)


@pytest.mark.parametrize("late", [0.0, 0.5 * WAITING_S])
def test_what_waited_while_the_node_stood_still_is_refused(late: float) -> None:
    """It cannot be known whether a stop came before it or after it."""
    epoch = Epoch(0.0)
    now = run(epoch, 0.0, 1.0) + 0.5
    if late:
        epoch.ran(now)
    with pytest.raises(MotionRefusedError, match=r"stood still for 0\.51 s: .* send it again"):
        epoch.begin(now + late)
    epoch.begin(run(epoch, now + late + PERIOD, 2.0 * WAITING_S))


def test_a_node_that_is_late_by_some_periods_refuses_nothing() -> None:
    """A busy machine is no reason."""
    epoch = Epoch(0.0)
    now = run(epoch, 0.0, 1.0)
    epoch.begin(now + 0.9 * STALL_S)
