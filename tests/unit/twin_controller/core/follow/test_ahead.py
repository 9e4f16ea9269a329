"""Numbers and times of the set points that a robot takes ahead of their time."""

from __future__ import annotations

from itertools import count

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from twin_controller.core.actions import StreamAhead
from twin_controller.core.events import AnyEvent, RealMeasured
from twin_controller.core.lead.modes import Mode

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
SLOW_S, QUICK_S = 0.02, 0.0005
"""Round trips: a set point is reckoned to arrive within 30 or within 5 ms."""


def test_no_number_is_given_anew_once_it_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """However the round trips change: the robot would lose the set points in between."""
    pair = Pair(places=10)
    pair.connect()
    feed, number = pair.feed, count()

    def late(event: AnyEvent) -> None:
        if isinstance(event, RealMeasured):
            trip = SLOW_S if next(number) % 3 == 0 else QUICK_S
            event = msgspec.structs.replace(event, sent=event.received - trip)
        feed(event)

    monkeypatch.setattr(pair, "feed", late)
    pair.move_twin(ramp(HOME, AWAY, 2.0))
    period, given, seen = SETUP.config.stream.ahead_period_ms, dict[int, int](), len(pair.actions)
    for _ in range(1500):
        pair.run(0.001)
        now_ms = 1e3 * (pair.now + pair.real_clock)
        for action in pair.actions[seen:]:
            for point in action.points if isinstance(action, StreamAhead) else ():
                old = given.get(point.number, point.clock_ms)
                assert old == point.clock_ms or old > now_ms, (point, old, now_ms)
                before = given.get(point.number - 1)
                if before is not None:
                    assert point.clock_ms - before == period, (point, before)
                given[point.number] = point.clock_ms
        seen = len(pair.actions)
    assert len(given) > 50 and pair.state.lead.mode == Mode.TWIN_LEADS
