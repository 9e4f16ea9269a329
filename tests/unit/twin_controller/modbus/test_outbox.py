"""The mailbox before the wire: set points at their time, commands at once, their order kept."""

from __future__ import annotations

import time

from twin_controller.core.actions import RobotSetpoint, StreamAhead, StreamReal
from twin_controller.modbus.outbox_io import Command, Outbox


def setpoint(q: float, at: float) -> StreamReal:
    """Return a set point that is to be written at ``at``."""
    return StreamReal(RobotSetpoint((q,)), 50.0, at)


def test_a_set_point_waits_for_its_time() -> None:
    """Not sooner, and not until the end of the wait."""
    box, due = Outbox(), time.monotonic() + 0.05
    left = setpoint(0.0, due)
    box.put_setpoint(left)
    assert box.take(time.monotonic() + 0.01) == (None, None, [])
    assert box.take(time.monotonic() + 5.0) == (left, None, [])
    assert due <= time.monotonic() < due + 2.0


def test_of_those_that_are_due_the_latest_wins_and_later_ones_wait() -> None:
    """A slow wire never makes a queue of old set points."""
    box, now = Outbox(), time.monotonic()
    early, due, later = (setpoint(float(k), now + at) for k, at in enumerate((-0.02, -0.01, 0.05)))
    for left in (early, due, later):
        box.put_setpoint(left)
    assert box.take(now + 5.0) == (due, None, [])
    assert box.take(now + 5.0) == (later, None, [])


def test_a_newer_decision_replaces_what_was_left_for_then_or_later() -> None:
    """A stream that begins anew does not wait for the old one's set points."""
    box, now = Outbox(), time.monotonic()
    newer = setpoint(1.0, now - 0.01)
    box.put_setpoint(setpoint(0.0, now + 60.0))
    box.put_setpoint(newer)
    assert box.take(now + 5.0) == (newer, None, [])
    assert box.take(now + 0.01) == (None, None, [])


def test_a_command_does_not_wait_for_a_set_point() -> None:
    """And a set point is not sent early because of it."""
    box, stop, later = Outbox(), Command("cstopi", True, True), time.monotonic() + 60.0
    box.put_setpoint(setpoint(0.0, later))
    box.put(stop)
    assert box.take(later) == (None, None, [stop])
    box.drop_setpoints()
    assert box.take(time.monotonic()) == (None, None, [])


def test_the_stream_program_is_asked_for_behind_a_fresh_set_point() -> None:
    """The next one goes with it; those after it keep their time."""
    box, start, later = Outbox(), Command("rsr1", True, True, behind=True), time.monotonic() + 60.0
    first = setpoint(0.0, later)
    box.put_setpoint(first)
    box.put_setpoint(setpoint(1.0, later + 0.01))
    box.put(start)
    assert box.take(later) == (first, None, [start])
    assert box.take(time.monotonic()) == (None, None, [])


def point(number: int, position: float) -> RobotSetpoint:
    """Return a set point ahead."""
    return RobotSetpoint((position,), number, 12 * number)


def test_set_points_ahead_are_written_at_once_and_together() -> None:
    """A newer one of the same number goes in place of the older; the newest number counts."""
    box = Outbox()
    box.put_ahead(StreamAhead((point(1, 0.0), point(2, 0.0)), 2, 50.0))
    box.put_ahead(StreamAhead((point(2, 1.0), point(3, 1.0)), 3, 40.0))
    start = Command("rsr1", True, True, behind=True)
    box.put(start)
    expected = StreamAhead((point(1, 0.0), point(2, 1.0), point(3, 1.0)), 3, 40.0)
    assert box.take(time.monotonic() + 5.0) == (None, expected, [start])
    assert box.take(time.monotonic()) == (None, None, [])


def test_a_stop_drops_set_points_ahead() -> None:
    """They are not written before it, and not after it, nor is the start that waits for them."""
    box, stop = Outbox(), Command("cstopi", True, True)
    box.put_ahead(StreamAhead((point(1, 0.0),), 1, 50.0))
    box.put(Command("rsr1", True, True, behind=True))
    box.drop_setpoints()
    box.put(stop)
    assert box.take(time.monotonic()) == (None, None, [stop])
    box.put_ahead(StreamAhead((point(1, 0.0), point(2, 0.0)), 2, 50.0))
    assert box.discard() == 2
    assert box.take(time.monotonic()) == (None, None, [])


def test_nothing_is_left_for_a_new_connection() -> None:
    """Set points and commands are dropped and counted."""
    box = Outbox()
    box.put_setpoint(setpoint(0.0, time.monotonic() + 60.0))
    box.put(Command("override", 50, False))
    assert box.discard() == 2
    assert box.take(time.monotonic()) == (None, None, [])
