"""What was asked for before a stop never begins after it."""

from __future__ import annotations

import math

import pytest
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.epoch import ENDING, Epoch
from scara_ros.standstill import GAP_S, WAITING_S, Standstill, said

PERIOD = 0.01
CANCELLED = "^cancelled by STOP: by the operator, before it began$"


def run(epoch: Epoch, begin: float, seconds: float) -> float:
    """Let a node run for a while; return the time after it."""
    for k in range(round(seconds / PERIOD) + 1):
        epoch.ran(begin + k * PERIOD)
    return begin + seconds


def stop(epoch: Epoch, given: float, now: float) -> None:
    """Let a STOP be read."""
    assert epoch.hear(Command.STOP, "by the operator", given, now)


@pytest.mark.parametrize("command", [Command.STOP, Command.ESTOP, Command.PAUSE])
def test_a_request_that_waited_through_a_stop_is_refused(command: Command) -> None:
    """It may have waited for a service, or for an older motion to end."""
    epoch = Epoch(1.0)
    now = run(epoch, 1.0, 1.0)
    request = epoch.begin(now, now)
    epoch.check(request)
    epoch.hear(command, "by the operator", 0.0, now)
    with pytest.raises(
        MotionRefusedError, match=f"^cancelled by {command.name}: by the operator, before it began$"
    ):
        epoch.check(request)
    epoch.check(epoch.begin(now + 0.001, now + 0.001))


@pytest.mark.parametrize("command", [Command.RESUME, Command.RESET])
def test_what_stops_nothing_ends_no_epoch(command: Command) -> None:
    """A release moves nothing and refuses nothing."""
    epoch = Epoch(1.0)
    request = epoch.begin(1.0, 1.0)
    assert epoch.hear(command, "", 1.0, 1.0)
    epoch.check(request)
    epoch.begin(1.0, 1.0)


@pytest.mark.parametrize("stalled", [0.02, 0.05, 0.1, 0.2, 0.24, 0.4, 1.0])
@pytest.mark.parametrize("stop_first", [True, False])
def test_a_stamped_request_is_judged_by_its_stamp(stalled: float, stop_first: bool) -> None:
    """However long the node or a node before it stood still, and whichever is read first."""
    epoch = Epoch(1.0)
    began = run(epoch, 1.0, 1.0)
    asked, given = began + 0.2 * stalled, began + 0.8 * stalled
    now = began + stalled
    if stop_first:
        stop(epoch, given, now)
        with pytest.raises(MotionRefusedError, match=CANCELLED):
            epoch.begin(asked, now + 0.001)
    else:
        request = epoch.begin(asked, now)
        stop(epoch, given, now + 0.001)
        with pytest.raises(MotionRefusedError, match=CANCELLED):
            epoch.check(request)


@pytest.mark.parametrize("late", [0.0, 0.3, 5.0])
def test_a_request_that_was_asked_for_after_the_stop_begins(late: float) -> None:
    """Also where the stop is read late: it was given before."""
    epoch = Epoch(1.0)
    now = run(epoch, 1.0, 1.0)
    stop(epoch, now, now + late)
    epoch.check(epoch.begin(now + 0.001, now + late + 0.001))


@pytest.mark.parametrize("stalled", [0.02, 0.1, 0.2, 1.0])
@pytest.mark.parametrize("found", [0.0, 0.5 * WAITING_S])
def test_a_request_without_a_stamp_is_as_old_as_the_gap_before_it(
    stalled: float, found: float
) -> None:
    """Nobody knows whether it was sent before the stop that waited beside it."""
    epoch = Epoch(1.0)
    now = run(epoch, 1.0, 1.0) + stalled
    stop(epoch, now - 0.5 * stalled, now)
    with pytest.raises(MotionRefusedError, match=CANCELLED):
        epoch.begin(0.0, now + found)
    later = run(epoch, now + PERIOD, 2.0 * WAITING_S)
    epoch.check(epoch.begin(0.0, later))


def test_gaps_of_a_busy_machine_refuse_nothing() -> None:
    """Without a stop in the gap nothing has gone wrong."""
    epoch = Epoch(1.0)
    now = run(epoch, 1.0, 1.0)
    stop(epoch, 0.0, now)
    now = run(epoch, now, 0.2)
    for gap in (0.02, 0.1, 0.5):
        now += gap
        assert epoch.ran(now) == pytest.approx(gap)
        epoch.check(epoch.begin(0.0, now))


def test_gaps_that_follow_each_other_count_together() -> None:
    """What waited through the first of them may come behind the second."""
    standstill = Standstill(1.0)
    for at in (1.5, 1.51, 1.54):
        standstill.seen(at)
    assert standstill.earliest(1.545) == 1.0
    # Behind the first it ran for 10 ms at most.
    for later in (GAP_S, 2 * WAITING_S):
        assert standstill.earliest(1.54 + later) == 1.0


@pytest.mark.parametrize("again", [0.03, 0.04, 0.07, 0.5])
def test_behind_two_standstills_nothing_from_before_a_stop_begins(again: float) -> None:
    """However long the second lasts, and whichever thread looks first."""
    epoch, standstill = Epoch(1.0), Standstill(1.0)
    stop(epoch, 1.5, 2.0)
    standstill.seen(2.0)
    assert standstill.earliest(2.0 + again) == 1.0
    with pytest.raises(MotionRefusedError, match=CANCELLED):
        epoch.begin(0.0, 2.0 + again)


def test_a_node_that_rests_goes_back_by_two_rests() -> None:
    """Each of them may have been a standstill, but something came of what waited in the first."""
    standstill = Standstill(1.0)
    for turn in range(100):
        standstill.seen(1.0 + 0.1 * turn)
    assert standstill.earliest(10.95) == pytest.approx(10.8)
    for turn in range(10):
        standstill.seen(10.95 + 0.01 * turn)
    assert standstill.earliest(11.05) == 11.05


@pytest.mark.parametrize("rests", [(), (0.3,), (0.9, 1.9)])
def test_what_waited_behind_another_request_is_as_old_as_that(rests: tuple[float, ...]) -> None:
    """Its reader was busy, while the node itself ran all the time, or rested now and then."""
    standstill = Standstill(1.0)
    for at in range(100, 201):
        if not any(begin < 0.01 * at < begin + 0.09 for begin in rests):
            standstill.seen(0.01 * at)
    standstill.blocked(1.2, 2.0)
    assert standstill.earliest(2.001) == 1.2
    for at in range(200, 211):
        standstill.seen(0.01 * at)
    standstill.blocked(2.105 - 0.5 * GAP_S, 2.105)
    assert standstill.earliest(2.105) == 2.105


@pytest.mark.parametrize("asked", [-1.0, math.nan, math.inf, 10.0, 1e300])
def test_another_clock_says_nothing(asked: float) -> None:
    """A stamp in the future is never newer than a stop, and never an older stop either."""
    assert not said(asked, 2.0)
    epoch = Epoch(1.0)
    now = run(epoch, 1.0, 1.0) + 0.3
    stop(epoch, asked, now)
    with pytest.raises(MotionRefusedError, match=CANCELLED):
        epoch.begin(asked, now + 0.001)


def test_a_release_from_before_a_stop_is_not_obeyed() -> None:
    """A RESET that waited must not release the ESTOP that came after it."""
    epoch = Epoch(1.0)
    assert epoch.hear(Command.ESTOP, "", 1.5, 2.0)
    assert not epoch.hear(Command.RESET, "", 1.4, 2.0)
    assert epoch.hear(Command.RESET, "", 1.6, 2.0)


@pytest.mark.parametrize("command", ENDING)
def test_a_stream_begins_behind_a_yield_only(command: Command) -> None:
    """YIELD makes room for whoever streams."""
    epoch = Epoch(1.0)
    epoch.hear(command, "", 1.0, 1.0)
    with pytest.raises(MotionRefusedError):
        epoch.begin(0.999, 1.001)
    if command is Command.YIELD:
        epoch.begin(0.999, 1.001, stream=True)
        return
    with pytest.raises(MotionRefusedError):
        epoch.begin(0.999, 1.001, stream=True)
