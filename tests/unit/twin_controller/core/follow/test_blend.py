"""A gap is closed smoothly and no faster than allowed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from twin_controller.core.follow.blend import Blend, begin_blend, finished, sample_blend

GAPS = st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=5)
SPEED = 0.3


@given(gaps=GAPS, share=st.floats(0.02, 0.98))
def test_velocity_and_acceleration_are_the_derivatives(gaps: list[float], share: float) -> None:
    """By central differences of the offset and of the velocity."""
    blend = begin_blend(tuple(gaps), 5.0, (SPEED,) * len(gaps))
    if blend.duration < 1e-3:
        return
    t, h = 5.0 + share * blend.duration, 1e-5 * blend.duration
    before, here, after = (sample_blend(blend, x) for x in (t - h, t, t + h))
    for order in (0, 1):
        slope = [(b - a) / (2 * h) for a, b in zip(before[order], after[order])]
        scale = max(abs(gap) for gap in gaps) / blend.duration ** (order + 1)
        assert list(here[order + 1]) == pytest.approx(slope, abs=1e-4 * scale)


@given(gaps=GAPS)
def test_no_joint_is_faster_than_allowed_and_one_is_just_as_fast(gaps: list[float]) -> None:
    """The slowest joint sets the time."""
    blend = begin_blend(tuple(gaps), 0.0, (SPEED,) * len(gaps))
    if blend.duration < 1e-6:
        return
    peak = max(
        abs(v) for k in range(101) for v in sample_blend(blend, 0.01 * k * blend.duration)[1]
    )
    assert peak == pytest.approx(SPEED, rel=1e-9)


@given(gaps=GAPS, t=st.floats(-10.0, 10.0))
def test_the_offset_shrinks_from_the_gap_to_zero(gaps: list[float], t: float) -> None:
    """Before the start the whole gap, afterwards zero, never beyond in between, never growing."""
    blend = begin_blend(tuple(gaps), 0.0, (SPEED,) * len(gaps))
    now, later = sample_blend(blend, t)[0], sample_blend(blend, t + 0.01)[0]
    for gap, a, b in zip(gaps, now, later):
        assert a * gap >= 0.0 and abs(b) <= abs(a) + 1e-12 <= abs(gap) + 2e-12
    if t <= 0.0 < blend.duration:
        assert now == tuple(gaps)
    assert finished(blend, t) == (t >= blend.duration)
    if finished(blend, t):
        assert set(now) == {0.0}


def test_a_blend_begins_and_ends_at_rest() -> None:
    """Velocity and acceleration are zero at both ends, so nothing jerks."""
    blend = Blend((1.0, -2.0), 3.0, 4.0)
    for t in (3.0, 7.0):
        _, rate, curve = sample_blend(blend, t)
        assert rate == pytest.approx((0.0, 0.0)) and curve == pytest.approx((0.0, 0.0))


@pytest.mark.parametrize("offset", [(), (0.0,), (0.0, 0.0)])
def test_no_gap_takes_no_time(offset: tuple[float, ...]) -> None:
    """Sides that agree are together at once."""
    blend = begin_blend(offset, 1.0, (SPEED,) * len(offset))
    assert finished(blend, 1.0)
    assert sample_blend(blend, 1.0) == (offset, offset, offset)


@pytest.mark.parametrize(
    ("gap", "closes"), [(0.0, False), (1e-8, False), (-1e-8, False), (1e-5, True)]
)
def test_a_gap_of_a_rounding_is_none(gap: float, closes: bool) -> None:
    """Closed within less than a microsecond it would be an acceleration beyond all numbers."""
    blend = begin_blend((gap, 0.0), 5.0, (SPEED, SPEED))
    assert (blend.duration > 0.0) is closes and finished(blend, 5.0) is not closes
