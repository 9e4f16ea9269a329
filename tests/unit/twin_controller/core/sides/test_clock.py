"""A remote clock's offset lies in intervals that always hold the truth; a jump starts anew."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from msgspec.structs import replace
from twin_controller.core.sides.clock import ClockEstimate, ClockTolerance, observe, unwrap_ms

SETTLED = 50
DRIFT_PPM = 500.0
WRAP = 1 << 31
DELAY = st.floats(0.0, 0.1)


def probe(
    estimate: ClockEstimate, at: float, offset: float, there: float, back: float
) -> ClockEstimate:
    """Ask a remote clock at ``at`` [s]; the way there and back takes the given times."""
    return observe(estimate, at + there + offset, at, at + there + back, DRIFT_PPM)


def test_an_unknown_clock_has_no_offset_and_is_infinitely_uncertain() -> None:
    """Before the first answer nothing may be compared."""
    fresh = ClockEstimate()
    assert (fresh.known, fresh.offset, fresh.uncertainty, fresh.drift_ppm) == (
        False,
        0.0,
        math.inf,
        0.0,
    )


@pytest.mark.parametrize(
    ("there", "back", "period"),
    [(0.001, 0.001, 0.0), (0.004, 0.0, 0.0), (0.0, 0.003, 0.002), (0.0, 0.0, 0.0)],
)
def test_uncertainty_of_one_answer_is_half_the_round_trip_and_the_reading_age(
    there: float, back: float, period: float
) -> None:
    """Closed form: the interval's width is the round trip plus the reading's largest age."""
    estimate = observe(ClockEstimate(), 50.0 + there, 10.0, 10.0 + there + back, DRIFT_PPM, period)
    assert estimate.uncertainty == pytest.approx(0.5 * (there + back + period), abs=1e-12)
    assert estimate.round_trip == pytest.approx(there + back)
    assert abs(estimate.offset - 40.0) <= estimate.uncertainty + 1e-12


def test_two_answers_with_opposite_asymmetry_find_the_offset_exactly() -> None:
    """All delay on the way there bounds from one side, all delay on the way back from the other."""
    estimate = probe(ClockEstimate(), 0.0, 7.0, 0.05, 0.0)
    estimate = probe(estimate, 0.05, 7.0, 0.0, 0.05)
    assert estimate.offset == pytest.approx(7.0, abs=0.05 * DRIFT_PPM * 1e-6)
    assert estimate.uncertainty <= 0.1 * DRIFT_PPM * 1e-6


def test_uncertainty_grows_with_the_largest_drift_while_only_poor_answers_come() -> None:
    """After T seconds the offset may have moved by T times the drift."""
    estimate = probe(ClockEstimate(), 0.0, 3.0, 0.0, 0.0)
    later = probe(estimate, 20.0, 3.0, 0.5, 0.5)
    assert later.uncertainty == pytest.approx(21.0 * DRIFT_PPM * 1e-6)
    assert later.samples == 2 and later.jumps == 0


def test_a_reading_is_younger_than_the_answer_before_it() -> None:
    """A robot that renews each 16 ms, asked each 9.7 ms: first seen, a reading is 9.7 ms old."""
    known, blind, before = ClockEstimate(), ClockEstimate(), -1e9
    shown = None
    for k in range(200):
        asked = 9.7e-3 * k
        reading = math.floor((asked + 1e-3) / 16e-3) * 16e-3
        if reading != shown:
            seen = (5.0 + reading, asked, asked + 2e-3, DRIFT_PPM, 16e-3)
            known, blind = observe(known, *seen, since=before), observe(blind, *seen)
            shown = reading
        before = asked
    assert abs(known.offset - 5.0) <= known.uncertainty <= 1.5e-3
    assert blind.uncertainty > 2.5e-3


@given(
    offset=st.floats(-1e6, 1e6),
    drift_ppm=st.floats(-200.0, 200.0),
    delays=st.lists(st.tuples(DELAY, DELAY), min_size=1, max_size=40),
)
def test_the_true_offset_is_always_inside(
    offset: float, drift_ppm: float, delays: list[tuple[float, float]]
) -> None:
    """For any delays and 200 ppm of drift no jump is seen and the interval holds the truth."""
    estimate, at = ClockEstimate(), 0.0
    for there, back in delays:
        asked = at + there
        remote = asked * (1.0 + drift_ppm * 1e-6) + offset
        at = asked + back
        estimate = observe(estimate, remote, asked - there, at, DRIFT_PPM)
        truth = at * drift_ppm * 1e-6 + offset
        slack = (there + back) * abs(drift_ppm) * 1e-6 + 1e-9
        assert estimate.jumps == 0
        assert estimate.lower - slack <= truth <= estimate.upper + slack
        at += 0.1


@pytest.mark.parametrize("drift_ppm", [200.0, -200.0, 0.0])
def test_drift_is_measured(drift_ppm: float) -> None:
    """Over a minute the estimate agrees with the truth to twice the uncertainty over the time."""
    estimate = ClockEstimate()
    for k in range(601):
        at = 0.1 * k
        estimate = observe(
            estimate, (at + 0.001) * (1.0 + drift_ppm * 1e-6) + 99.0, at, at + 0.002, DRIFT_PPM
        )
    assert estimate.drift_ppm == pytest.approx(drift_ppm, abs=2.0 * 0.001 / 60.0 * 1e6)
    assert estimate.uncertainty <= 0.001 + 1e-9


@pytest.mark.parametrize("jump", [3600.0, -3600.0, 0.2, -0.2])
def test_a_jump_starts_the_estimate_anew(jump: float) -> None:
    """Intervals that do not meet mean that a clock was set; nothing of the old estimate stays."""
    estimate = probe(ClockEstimate(), 0.0, 5.0, 0.001, 0.001)
    after = probe(estimate, 1.0, 5.0 + jump, 0.001, 0.001)
    assert (after.jumps, after.samples) == (1, 1)
    assert after.offset == pytest.approx(5.0 + jump, abs=0.001)
    assert after.first_at == after.at


@pytest.mark.parametrize("late", [0.005, 0.03, 0.09])
def test_a_late_reading_is_no_jump_and_counts_as_old(late: float) -> None:
    """A starved remote answers with an older reading: the offset stays, its stamp tells the age."""
    estimate = probe(ClockEstimate(), 0.0, 5.0, 0.001, 0.001)
    after = probe(estimate, 1.0, 5.0 - late, 0.001, 0.001)
    assert after.jumps == 0
    assert after.offset == pytest.approx(5.0, abs=0.002)
    assert after.to_local(1.001 + 5.0 - late) == pytest.approx(1.001 - late, abs=0.002)


def test_a_contradiction_is_part_of_the_uncertainty_while_it_lasts() -> None:
    """After a small step of a clock nobody is first, until the clock is trusted again."""
    estimate = probe(ClockEstimate(), 0.0, 5.0, 0.001, 0.001)
    doubtful = probe(estimate, 0.1, 4.95, 0.001, 0.001)
    assert doubtful.uncertainty == pytest.approx(0.05, abs=0.003)
    assert probe(doubtful, 0.2, 5.0, 0.001, 0.001).uncertainty == pytest.approx(0.001, abs=0.001)


def test_a_small_step_back_that_stays_is_a_jump_in_the_end() -> None:
    """No machine is late in the same way for half a second."""
    estimate, at = probe(ClockEstimate(), 0.0, 5.0, 0.001, 0.001), 0.0
    for _ in range(50):
        assert estimate.jumps == 0
        at += 0.01
        estimate = probe(estimate, at, 4.95, 0.001, 0.001)
    assert estimate.jumps == 1
    assert estimate.offset == pytest.approx(4.95, abs=0.001)


def test_a_small_step_forward_is_followed_at_once() -> None:
    """No answer can hold a time that has not been yet."""
    estimate = probe(ClockEstimate(), 0.0, 5.0, 0.001, 0.001)
    after = probe(estimate, 1.0, 5.05, 0.001, 0.001)
    assert after.jumps == 0
    assert after.offset == pytest.approx(5.05, abs=0.002)


def test_a_clock_that_runs_backwards_is_never_trusted() -> None:
    """Each answer contradicts the one before."""
    estimate = ClockEstimate()
    for k in range(20):
        estimate = observe(estimate, 1000.0 - 0.1 * k, 0.1 * k, 0.1 * k + 0.002, DRIFT_PPM)
        assert estimate.samples == 1
    assert estimate.jumps == 19


@given(offset=st.floats(-1e6, 1e6), t=st.floats(0.0, 1e6))
def test_conversion_there_and_back_is_the_identity(offset: float, t: float) -> None:
    """to_remote undoes to_local."""
    estimate = ClockEstimate(offset, offset, 0.0, 1)
    assert estimate.to_local(estimate.to_remote(t)) == pytest.approx(t, abs=1e-9)


@pytest.mark.parametrize(
    ("previous", "read", "expected"),
    [
        (None, 17, 17),
        (None, WRAP - 1, WRAP - 1),
        (1000, 1010, 1010),
        (1000, 990, 990),
        (1000, 1000, 1000),
        (WRAP - 1, 0, WRAP),
        (WRAP - 3, 7, WRAP + 7),
        (WRAP + 2, WRAP - 5, WRAP - 5),
        (3 * WRAP - 1, 4, 3 * WRAP + 4),
    ],
)
def test_a_counter_goes_on_across_its_wrap(previous: int | None, read: int, expected: int) -> None:
    """2^31 ms is 24.9 days; a step back stays a step back."""
    assert unwrap_ms(previous, read) == expected


@given(previous=st.integers(0, 10 * WRAP), step=st.integers(-(1 << 30), (1 << 30) - 1))
def test_unwrapping_finds_any_step_below_half_the_range(previous: int, step: int) -> None:
    """The nearest value with the same remainder is the true one."""
    assert unwrap_ms(previous, (previous + step) % WRAP) == previous + step


def test_a_patient_estimate_waits_for_a_remote_that_is_held_up() -> None:
    """On a desk the stand-in shares the machine: it shows an old time, and catches up."""
    patience = ClockTolerance(jump=0.7, lasting=300)
    estimate, late = ClockEstimate(), 0.0
    for k in range(600):
        now = 50.0 + 0.01 * k
        late = min(late + 0.005, 0.5) if 100 <= k < 250 else max(late - 0.01, 0.0)
        estimate = observe(estimate, now + 7.0 - late, now - 1e-3, now, 500.0, patience=patience)
    assert estimate.jumps == 0 and estimate.doubt == 0.0
    assert estimate.offset == pytest.approx(7.0, abs=2e-3)


@example([(0.0, 0.0)] * 70 + [(0.05, 0.05)] * 50, 80)
@given(st.lists(st.tuples(DELAY, DELAY), min_size=120, max_size=120), st.integers(60, 110))
def test_a_settled_offset_goes_slowly_and_stays_within_its_bounds(
    delays: list[tuple[float, float]], wide: int
) -> None:
    """A bound that goes out for a while moves nothing at once, and the truth stays covered."""
    estimate, at, truth = ClockEstimate(), 0.0, 12.0
    for number, (there, back) in enumerate(delays):
        before = estimate
        if number == wide:
            before = replace(estimate, upper=estimate.upper + 0.003)
        estimate = probe(before, at, truth, 0.1 * there, 0.1 * back)
        lower, upper, offset = estimate.lower, estimate.upper, estimate.offset
        assert lower <= offset <= upper
        assert abs(offset - truth) <= estimate.uncertainty + 1e-12
        if number > SETTLED:
            step = estimate.at - before.at
            forced = max(0.0, lower - before.offset, before.offset - upper)
            assert abs(offset - before.offset) <= max(0.005 * step, forced) + 1e-12
        at = estimate.at + 0.01
