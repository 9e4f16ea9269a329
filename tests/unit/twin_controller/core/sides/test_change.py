"""A side moved when its rounded position left the agreed one by more than noise, and since when."""

from __future__ import annotations

import math
import random

import msgspec
import pytest
from harness.pair import SETUP
from harness.running.thorough import examples
from hypothesis import given
from hypothesis import strategies as st
from twin_controller.core.sides import change
from twin_controller.core.sides.change import ChangeState

CONFIG = SETUP.config.change
STEP = 10.0**-CONFIG.decimals
THRESHOLD = CONFIG.hysteresis + 0.5 * STEP
PERIOD = 0.01


def agreed(*q: float) -> ChangeState:
    """Return a side that has agreed on ``q``."""
    return change.take_baseline(ChangeState(), 0.0, q, CONFIG)


def fed(state: ChangeState, *values: float, start: float = 0.0) -> ChangeState:
    """Feed one joint's values, one each period."""
    for k, value in enumerate(values):
        state = change.update(state, start + k * PERIOD, (value,), CONFIG)
    return state


def test_the_agreed_position_is_rounded_as_the_article_does() -> None:
    """Two decimals in degrees and millimetres."""
    assert agreed(1.23456, -7.891).baseline == (1.23, -7.89)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((0.0, 0.0, 0.0), False),
        ((0.02, -0.02, 0.02), False),
        ((0.024, -0.024, 0.024), False),
        ((0.03, 0.0, 0.0), False),
        ((0.03, 0.0, 0.0, 0.03, 0.0, 0.0), False),
        ((0.03, 0.03), True),
        ((-0.03, -0.03), True),
        ((0.03, 0.0, 0.03), True),
        ((0.03, -0.03), True),
        ((9.0,), False),
    ],
)
def test_a_change_is_confirmed_by_two_of_three_samples(
    values: tuple[float, ...], expected: bool
) -> None:
    """A single spike, however large, moves nobody; rounding plus hysteresis is the threshold."""
    assert change.moved(fed(agreed(0.0), *values), CONFIG) is expected


def test_every_joint_counts() -> None:
    """One joint that moves is enough."""
    state = agreed(0.0, 10.0, 20.0)
    for k in range(2):
        state = change.update(state, k * PERIOD, (0.0, 10.0, 20.05), CONFIG)
    assert change.moved(state, CONFIG)


def test_nothing_counts_before_a_baseline_is_taken_and_after_it_is_dropped() -> None:
    """Without an agreed position there is no change."""
    assert not change.moved(fed(ChangeState(), 0.0, 5.0, 9.0), CONFIG)
    assert not change.moved(fed(change.drop_baseline(agreed(0.0)), 0.0, 5.0, 9.0), CONFIG)


@given(start=st.floats(0.0, 0.0099), speed=st.floats(1.0, 400.0))
def test_onset_is_the_interpolated_crossing_not_the_sample(start: float, speed: float) -> None:
    """A steady joint crosses at start + threshold / speed; only the rounding's error remains."""
    values = [max(0.0, speed * (k * PERIOD - start)) for k in range(9)]
    state = fed(agreed(0.0), *values)
    crossing = start + THRESHOLD / speed
    # The last sample inside may be one rounding off, and a joint at rest until ``start`` bends the
    # line between two samples.
    assert state.onset is not None
    assert crossing - PERIOD <= state.onset <= crossing + PERIOD
    if speed * PERIOD <= THRESHOLD:
        assert state.onset == pytest.approx(crossing, abs=1.01 * STEP / speed)


def test_onset_is_forgotten_when_the_side_comes_back() -> None:
    """A disturbance that has passed is not the beginning of a later motion."""
    state = fed(agreed(0.0), 0.0, 0.05, 0.0, 0.0, 0.0)
    assert state.onset is None
    later = fed(state, 0.0, 1.0, 2.0, start=1.0)
    assert later.onset is not None and later.onset == pytest.approx(1.0, abs=PERIOD)


def test_an_echo_moves_the_agreed_position_along() -> None:
    """A follower that did what it was told has not moved on its own."""
    state = agreed(0.0)
    for k in range(50):
        state = change.update(state, k * PERIOD, (0.1 * k,), CONFIG, echo=True)
    assert state.baseline == (4.9,)
    assert not change.moved(fed(state, 4.9, 4.9, 4.9, start=0.5), CONFIG)


@pytest.mark.parametrize(
    ("values", "still"),
    [
        ((0.0,) * 20, True),
        ((0.0,) * 10, False),
        ((0.0, 0.02, -0.02) * 7, True),
        ((0.02, -0.02) * 10, True),
    ],
)
def test_a_side_stands_still_after_it_stayed_near_one_place(
    values: tuple[float, ...], still: bool
) -> None:
    """still_time_ms within still_tolerance of where it stopped."""
    state = fed(ChangeState(), *values)
    assert change.stands_still(state, (len(values) - 1) * PERIOD, CONFIG) is still


def test_slow_creeping_is_no_standstill() -> None:
    """The range that it may stay in does not creep along."""
    state = fed(ChangeState(), *(0.002 * k for k in range(400)))
    assert not change.stands_still(state, 399 * PERIOD, CONFIG)


def test_an_unknown_side_does_not_stand_still() -> None:
    """No sample, no standstill, however long ago."""
    assert not change.stands_still(ChangeState(), 1e9, CONFIG)


EDGE = st.integers(-18000, 18000).map(lambda k: k * STEP + 0.5 * STEP)
NOISE = st.lists(st.floats(-0.5, 0.5), min_size=2, max_size=200)


@given(centre=EDGE, noise=NOISE)
def test_noise_on_a_rounding_edge_is_no_change(centre: float, noise: list[float]) -> None:
    """As wide as the hysteresis, peak to peak, on x.xx5 as anywhere, a noisy agreement too."""
    width = math.nextafter(CONFIG.hysteresis, 0.0) * (1 - 1e-9)
    values = [centre + width * part for part in noise]
    state = fed(agreed(values[0]), *values[1:])
    assert not change.moved(state, CONFIG)


DRIFT = 0.2
"""Of the smallest step shown: a drive that settles."""


@pytest.mark.parametrize("seed", range(examples(5, 20)))
def test_noise_beside_a_drive_that_settles_is_no_change(seed: int) -> None:
    """The agreed position is a mean: one sample at the noise's edge would make noise a change."""
    rng = random.Random(seed)
    centre = rng.uniform(-90.0, 90.0)
    half = 0.5 * CONFIG.hysteresis
    state = fed(ChangeState(), *(centre + rng.uniform(-half, half) for _ in range(30)))
    state = change.take_baseline(state, 0.3, (centre + half,), CONFIG)
    for k in range(20_000):
        drifted = centre - DRIFT * STEP * min(1.0, k / 5000)
        state = change.update(
            state, 0.3 + k * PERIOD, (drifted + rng.uniform(-half, half),), CONFIG
        )
        assert not change.moved(state, CONFIG), f"sample {k}"


DURATION, REACH = 3.0, 0.09


def settled(state: ChangeState, t: float = 1.0) -> ChangeState:
    """Return the side after it was given room to settle."""
    return change.settle(state, t, CONFIG, DURATION, REACH)


@pytest.mark.parametrize(
    ("zero", "begun", "off", "later", "expected"),
    [
        (0.0, 0.0, 0.012, 1.0, 0.01),
        (0.0, 0.0, 0.012, DURATION + 0.1, 0.0),
        (0.0, 0.0, -0.038, 1.0, -0.04),
        (0.0, 0.0, 0.1, 1.0, 0.0),
        # Counted from where it was agreed, not from the joint's zero, and it may come back to that.
        *(
            (zero, 0.0, off, 1.0, round(off, 2))
            for zero in (50.0, -50.0)
            for off in (0.012, -0.012)
        ),
        *((zero, 0.0, 0.1, 1.0, 0.0) for zero in (50.0, -50.0)),
        (0.5, 0.0, -0.5, 1.0, 0.0),
        # And from when: a controller may have run for days.
        (0.0, 1000.0, 0.012, 0.5 * DURATION, 0.01),
        (0.0, 1000.0, 0.012, 2.0 * DURATION, 0.0),
    ],
)
def test_the_agreed_position_goes_along_with_a_side_that_settles(
    zero: float, begun: float, off: float, later: float, expected: float
) -> None:
    """For a while and a little way; what goes on after that is a motion."""
    state = fed(ChangeState(), *(zero,) * 16, start=begun)
    state = fed(
        change.take_baseline(state, begun, (zero,), CONFIG), *(zero + off,) * 300, start=begun
    )
    state = msgspec.structs.replace(state, recent=(False,) * 3)
    assert settled(state, begun + later).baseline == pytest.approx((zero + expected,), abs=1e-9)


def test_a_sample_that_looks_like_a_change_holds_the_agreed_position() -> None:
    """A motion that began keeps its onset; without a mean or an agreement none is taken."""
    state = change.take_baseline(fed(ChangeState(), *(0.0,) * 16), 0.0, (0.0,), CONFIG)
    state = fed(state, *(0.012,) * 100)
    begun = fed(state, 0.04)
    assert settled(state) != state
    assert begun.recent == (False, False, True) and settled(begun) == begun
    fresh = fed(agreed(0.0), 0.012)
    assert settled(fresh) == fresh
    alone = fed(ChangeState(), *(0.0,) * 16)
    assert settled(alone) == alone


def test_the_agreed_position_of_a_side_that_moves_is_where_it_is() -> None:
    """A mean over samples of a motion would lie behind."""
    state = fed(ChangeState(), *(0.5 * k for k in range(40)))
    assert change.take_baseline(state, 0.4, (19.5,), CONFIG).baseline == (19.5,)


@given(centre=EDGE, noise=NOISE)
def test_a_decision_does_not_depend_on_where_zero_is(centre: float, noise: list[float]) -> None:
    """Shifting agreed position and samples by whole rounding steps changes nothing."""
    values = [0.1 * part for part in noise]
    near = fed(agreed(values[0]), *values[1:])
    far = fed(agreed(values[0] + 64.0), *(value + 64.0 for value in values[1:]))
    assert near.recent == far.recent or any(
        abs(value / STEP % 1.0 - 0.5) < 1e-6 for value in values
    )


def test_rounding_is_that_of_the_configuration() -> None:
    """With one decimal fewer the threshold follows."""
    coarse = msgspec.structs.replace(CONFIG, decimals=1)
    state = change.take_baseline(ChangeState(), 0.0, (0.04,), coarse)
    assert state.baseline == (0.0,)
    for k in range(2):
        state = change.update(state, k * PERIOD, (0.06,), coarse)
    assert change.moved(state, coarse)


@pytest.mark.parametrize("zero", [0.0, 7.0])
def test_the_onset_lies_where_the_line_between_two_samples_crosses(zero: float) -> None:
    """Half of the way from 0.01 off to as far beyond the threshold is half of the time."""
    state = fed(agreed(zero), zero + 0.01)
    state = change.update(state, PERIOD, (zero + 2.0 * THRESHOLD - 0.01,), CONFIG)
    assert state.onset == pytest.approx(0.5 * PERIOD, abs=1e-9)


def test_the_mean_of_a_side_that_stands_is_that_of_its_samples() -> None:
    """The running mean is the plain one as long as it has fewer samples than it is made of."""
    values = [30.0 + 0.001 * k for k in range(10)]
    assert fed(ChangeState(), *values).mean == pytest.approx((sum(values) / 10,), abs=1e-12)
