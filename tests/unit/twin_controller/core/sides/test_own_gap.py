"""The controller's own standstill is nobody's silence, as long as it is short."""

from __future__ import annotations

import pytest
from harness.pair import Pair
from twin_controller.config import OwnGap
from twin_controller.core.events import Tick
from twin_controller.core.lead.modes import Mode
from twin_controller.core.sides.own_gap import OwnGaps, silence, stall_text

LIMITS = OwnGap(notice_ms=30.0, forgive_ms=100.0, window_ms=1000.0)


def looks(*times: float) -> list[float]:
    """Look at these times and return the gaps that are forgiven."""
    gaps = OwnGaps(LIMITS)
    return [gaps.look(now) for now in times]


def test_looks_in_time_show_no_gap() -> None:
    """The first look has none before it."""
    assert looks(5.0, 5.01, 5.02, 5.045) == [0.0] * 4


def test_a_late_look_shows_how_long_the_controller_stood_still() -> None:
    """The whole time since the look before: nobody listened in it."""
    assert looks(5.0, 5.07, 5.08) == pytest.approx([0.0, 0.07, 0.0])


def test_a_long_gap_is_not_forgiven() -> None:
    """The data are old by then, and the robot's watchdog has stopped it."""
    assert looks(5.0, 5.3, 5.31) == [0.0] * 3


def test_gaps_are_forgiven_within_a_budget() -> None:
    """A controller that hardly runs finds a silent robot all the same."""
    assert looks(5.0, 5.06, 5.12, 5.13) == pytest.approx([0.0, 0.06, 0.0, 0.0])


def test_the_budget_is_new_after_its_window() -> None:
    """A gap each second is a busy machine, not a silent robot."""
    times = [5.0, 5.08, *(5.08 + 0.01 * k for k in range(1, 111)), 6.26]
    gaps = looks(*times)
    assert gaps[1] == pytest.approx(0.08)
    assert gaps[-1] == pytest.approx(0.08)


def test_each_gap_leaves_the_budget_when_its_own_window_is_over() -> None:
    """One that came later still counts."""
    early, late, soon = 0.06, 0.04, 0.05

    def until(begin: float, end: float) -> list[float]:
        return [begin + 0.02 * k for k in range(1, round((end - begin) / 0.02) + 1)]

    times = [5.0, 5.0 + early, *until(5.06, 5.8), 5.8 + late, *until(5.84, 6.08), 6.08 + soon]
    gaps = looks(*times)
    assert [gap for gap in gaps if gap] == pytest.approx([early, late, soon])
    assert looks(*times, 6.13 + late)[-1] == 0.0


@pytest.mark.parametrize(
    ("deaf", "expected"),
    [
        ((0.0, 0.0), 0.3),
        ((5.1, 5.2), 0.2),
        ((4.9, 5.1), 0.2),
        ((4.7, 4.9), 0.3),
        ((5.2, 5.3), 0.2),
        ((4.9, 5.4), 0.0),
    ],
)
def test_silence_is_what_was_listened_to(deaf: tuple[float, float], expected: float) -> None:
    """What lies before the last word or behind now takes nothing away."""
    assert silence(5.0, 5.3, deaf) == pytest.approx(expected)


def test_the_age_of_a_sides_data_stays_what_it_is(pair: Pair) -> None:
    """A set point made of old data is rejected, however late the controller was."""
    seen = pair.state.sides.twin.seen
    stand_still(pair, 0.06, own_gap=0.06)
    assert pair.state.sides.twin.seen == seen


@pytest.mark.parametrize(
    ("stood", "ago", "named"),
    [(0.2, 0.0, True), (0.2, 0.99, True), (0.2, 1.01, False), (0.0, 0.0, False)],
)
def test_a_stall_is_named_as_the_cause_for_a_moment(stood: float, ago: float, named: bool) -> None:
    """What comes a second later has another one; where it never stood there is none."""
    said = stall_text((5.0, stood), 5.0 + ago)
    assert said == ("this machine stood still for 0.20 s" if named else "")


def stand_still(pair: Pair, duration: float, own_gap: float) -> None:
    """Let the controller stand still, and all that would tell it something; then it looks."""
    pair.now = round(pair.now + duration, 6)
    pair.feed(Tick(pair.now, own_gap))


def test_a_gap_of_the_controller_costs_no_link(pair: Pair) -> None:
    """Both sides have spoken meanwhile, and their words wait in the sockets."""
    stand_still(pair, 0.099, own_gap=0.099)
    pair.run(1.0)
    assert pair.mode is Mode.IDLE
    assert "LINK_LOST" not in pair.triggers()


def test_a_look_without_a_gap_judges_as_before(pair: Pair) -> None:
    """What was recorded without the field is decided as it was."""
    stand_still(pair, 0.12, own_gap=0.0)
    assert pair.mode is Mode.OFFLINE


@pytest.mark.parametrize(("side", "limit"), [("real", 0.1), ("twin", 0.22)])
def test_a_silent_side_is_found_after_a_gap_too(pair: Pair, side: str, limit: float) -> None:
    """Its silence counts from where the gap began, and goes on where it ended."""
    setattr(pair, f"{side}_up", False)
    stand_still(pair, 0.06, own_gap=0.06)
    begun = pair.now
    pair.until(Mode.OFFLINE, 0.4)
    assert pair.now - begun <= limit + 0.011
    assert side == "twin" or "no fresh data for 100 ms" in pair.why


@pytest.mark.parametrize("duty", [0.035, 0.05, 0.09])
def test_a_silent_side_is_found_at_most_one_budget_later(pair: Pair, duty: float) -> None:
    """However the controller's gaps lie, silence counts in full beyond the budget of the window."""
    gaps, begun = OwnGaps(LIMITS), pair.now
    gaps.look(pair.now)
    while pair.mode is Mode.IDLE:
        stand_still(pair, duty, gaps.look(pair.now + duty))
    assert pair.now - begun <= 0.1 + 0.1 + 2 * duty
