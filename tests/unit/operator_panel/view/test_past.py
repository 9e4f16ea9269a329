"""The last ten minutes of the page."""

from __future__ import annotations

from operator_panel.view.frame import Frame
from operator_panel.view.past import KEPT_S, PERIOD_S, Past, PastMoment

START = 1_900_000_000.0
WINDOW_S = 20.0


def filled(seconds: float) -> Past:
    """Return a past of frames that say their own time, one each period."""
    past = Past()
    for number in range(int(seconds / PERIOD_S) + 1):
        add(past, number * PERIOD_S)
    return past


def add(past: Past, after: float) -> None:
    """Add a frame that says how long after the start it was made."""
    frame = Frame(after, {"mode": f"{after:g}"}, {}, point={"joint_1": (after, after)})
    past.keep(PastMoment(START + after, frame.t, lambda: frame, lambda: frame.point, {}))


def test_moment_nearest_to_the_time_is_found_with_the_points_before_it() -> None:
    """What a page shows as of 14:03:20."""
    look = filled(60.0).look(START + 30.2, WINDOW_S)
    assert look is not None
    assert (look.at, look.frame.text["mode"]) == (START + 30.0, "30")
    assert (look.first, look.last) == (START, START + 60.0)
    assert look.frame.point == {}, "points come as rows"
    times = [time for time, _ in look.rows]
    assert (times[0], times[-1]) == (10.5, 30.0) and times == sorted(times)


def test_time_before_and_after_all_that_is_known_is_the_end_of_it() -> None:
    """A slider has ends."""
    past = filled(10.0)
    for asked, found in ((-50.0, 0.0), (99.0, 10.0), (4.26, 4.5), (4.24, 4.0)):
        look = past.look(START + asked, WINDOW_S)
        assert look is not None and look.at == START + found
    assert Past().look(START, WINDOW_S) is None


def test_only_ten_minutes_are_kept_and_no_more_often_than_needed() -> None:
    """The memory of the page's server does not grow with the day."""
    past = filled(KEPT_S + 100.0)
    look = past.look(START, WINDOW_S)
    assert look is not None and look.first == START + 100.0
    newest = START + KEPT_S + 100.0
    assert not past.is_due(newest + 0.1) and past.is_due(newest + PERIOD_S)


def test_clock_that_was_set_back_begins_a_new_past() -> None:
    """Moments out of order would be found by nobody."""
    past = filled(10.0)
    assert past.is_due(START - 3600.0)
    add(past, -3600.0)
    look = past.look(START, WINDOW_S)
    assert look is not None and look.first == look.last == START - 3600.0
