"""The watch of the core sees a rule that is broken, however the robot takes its set points."""

from __future__ import annotations

from typing import Any

import pytest
from harness.pair import HOME, Pair, ramp, shifted
from harness.watch import watched
from twin_controller.core.follow import real

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
PLACES = pytest.mark.parametrize("places", [0, 10], ids=["one by one", "ahead of their time"])


def paused(places: int) -> Pair:
    """Return a pair whose twin led and slowed down on its way, while its robot was held at once."""
    pair = watched(Pair(places=places))
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=1.0)
    pair.do("PAUSE", 1.0)
    assert pair.far() > 1.0
    return pair


@PLACES
def test_a_stream_that_begins_where_the_robot_is_keeps_the_rule(places: int) -> None:
    """The gap to the twin is closed from there."""
    paused(places).do("RESUME", 1.0)


@PLACES
def test_a_stream_that_begins_elsewhere_is_found(
    places: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here where the twin is: the robot would jump there."""
    pair, close_gap = paused(places), real.close_gap

    def at_once(setup: Any, offset: tuple[float, ...], start: float) -> Any:
        return close_gap(setup, (0.0,) * len(offset), start)

    monkeypatch.setattr(real, "close_gap", at_once)
    with pytest.raises(AssertionError, match="a stream begins where the real robot is"):
        pair.do("RESUME", 1.0)
