"""The errors of a run, held against closed forms."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from harness.running.thorough import examples
from harness.workspace import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from twin_experiments.config import load_experiments
from twin_experiments.metrics.errors import (
    Comparison,
    MetricsSettings,
    Move,
    Rest,
    compare,
    deviation_mm,
    summarize,
    trace,
)
from twin_experiments.metrics.series import (
    Array,
    MetricsError,
    Motion,
    SampleGap,
    align,
    find_gaps,
    interpolate,
    known_at,
    known_steps,
    true_runs,
)
from twin_experiments.report.record import cut

SETTINGS = MetricsSettings(reach_mm=650.0, moving_speeds=np.full(3, 1e-3))
AMPLITUDE, FREQUENCY = 0.1, 1.3  # [m], [Hz]


def identity(q: Array) -> Array:
    """Take the joints for the tool: three sliding joints along x, y, z."""
    return q


def wave(
    side: str,
    *,
    delay: float = 0.0,
    shift: float = 0.0,
    rate: float = 250.0,
    seconds: float = 8.0,
    offset_mm: float = 0.0,
) -> Motion:
    """One tool coordinate follows a sine, ``delay`` [s] late, off by ``offset_mm`` in x."""
    stamps = np.arange(round(seconds * rate)) / rate
    omega = 2.0 * math.pi * FREQUENCY
    zeros = np.zeros_like(stamps)
    angle = omega * (stamps - delay)
    positions = np.column_stack((zeros + offset_mm * 1e-3, AMPLITUDE * np.sin(angle), zeros))
    velocities = np.column_stack((zeros, AMPLITUDE * omega * np.cos(angle), zeros))
    return Motion(side, stamps + shift, positions, velocities)


def reach_and_hold(
    side: str, *, at: float = 1.0, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Motion:
    """Rest, move 0.2 m along x within 1 s, rest again; off by ``offset`` [m] all the time."""
    stamps = np.arange(0.0, 4.0, 0.005)
    u = np.clip(stamps - at, 0.0, 1.0)
    x = 0.2 * (3.0 * u**2 - 2.0 * u**3)
    speed = 0.2 * (6.0 * u - 6.0 * u**2)
    zeros = np.zeros_like(stamps)
    return Motion(
        side,
        stamps,
        np.column_stack((x, zeros, zeros)) + offset,
        np.column_stack((speed, zeros, zeros)),
    )


def both(real: Motion, twin: Motion, leader: str = "real", **positions: Array) -> Comparison:
    """Compare with the settings of this module."""
    return compare(real, twin, identity, SETTINGS, leader, positions)  # type: ignore[arg-type]


def test_a_lag_of_seven_milliseconds_is_found_between_samples_of_different_rates() -> None:
    """The lag is estimated to a fraction of an instant, from series that share no stamp."""
    found = both(wave("real"), wave("twin", delay=0.007, rate=200.0))
    assert found.lag_s == pytest.approx(0.007, abs=2e-5)


def test_the_path_error_of_a_delayed_sine_is_its_closed_form_and_goes_with_the_lag() -> None:
    """|sin(x) - sin(x - d)| has the maximum 2 sin(d / 2) and that divided by sqrt 2 as rms.

    What is left after the lag is taken out is interpolation only.
    """
    found = both(wave("real"), wave("twin", delay=0.007))
    largest = 2.0 * AMPLITUDE * math.sin(math.pi * FREQUENCY * 0.007) * 1e3
    assert found.path.max_mm == pytest.approx(largest, rel=1e-3)
    assert found.path.rms_mm == pytest.approx(largest / math.sqrt(2.0), rel=1e-2)
    assert found.path.max_percent == pytest.approx(100.0 * largest / 650.0, rel=1e-3)
    assert found.path.rms_percent == pytest.approx(100.0 * found.path.rms_mm / 650.0)
    assert found.path_after_lag is not None
    assert found.path_after_lag.max_mm < 0.01 < 1.0 < found.path.max_mm


def test_a_leader_that_is_behind_has_a_negative_lag() -> None:
    """The sign belongs to the roles, not to the sides."""
    found = both(wave("real", delay=0.02), wave("twin"), "real")
    assert found.lag_s == pytest.approx(-0.02, abs=2e-5)


def test_noise_of_a_tenth_of_a_millimetre_moves_the_lag_by_less_than_a_fifth_of_a_millisecond() -> (
    None
):
    """The estimate uses the whole run, so sample noise averages out."""
    noisy = wave("twin", delay=0.007)
    noise = np.random.default_rng(1).normal(0.0, 1e-4, noisy.positions.shape)
    found = both(wave("real"), dataclasses.replace(noisy, positions=noisy.positions + noise))
    assert found.lag_s == pytest.approx(0.007, abs=2e-4)


@given(lag_ms=st.floats(-60.0, 60.0), offset_mm=st.floats(-20.0, 20.0))
@settings(max_examples=examples(8, 40))
def test_swapping_the_sides_changes_only_the_sign_of_the_lag(
    lag_ms: float, offset_mm: float
) -> None:
    """No figure prefers one side."""
    ahead, behind = wave("real"), wave("twin", delay=lag_ms * 1e-3, offset_mm=offset_mm)
    one, other = (
        both(ahead, behind),
        both(dataclasses.replace(behind, side="real"), dataclasses.replace(ahead, side="twin")),
    )
    assert one.lag_s == pytest.approx(-other.lag_s, abs=1e-9)  # type: ignore[operator]
    assert one.path == other.path
    assert one.path_after_lag is not None and other.path_after_lag is not None
    assert one.path_after_lag.max_mm == pytest.approx(other.path_after_lag.max_mm, abs=1e-6)


@given(shift=st.floats(-1e6, 1e6))
@settings(max_examples=examples(8, 40))
def test_a_common_clock_shift_changes_nothing(shift: float) -> None:
    """Only differences of stamps matter."""
    plain = both(wave("real"), wave("twin", delay=0.01))
    moved = both(wave("real", shift=shift), wave("twin", delay=0.01, shift=shift))
    assert moved.path.max_mm == pytest.approx(plain.path.max_mm, rel=1e-4)
    assert moved.path.rms_mm == pytest.approx(plain.path.rms_mm, rel=1e-4)
    assert moved.lag_s == pytest.approx(plain.lag_s, abs=1e-6)


@given(offset_mm=st.floats(0.01, 50.0))
@settings(max_examples=examples(8, 40))
def test_a_static_offset_is_the_error(offset_mm: float) -> None:
    """A twin that stands d mm beside the robot has the path error d, rms d, and no lag."""
    found = both(wave("real"), wave("twin", offset_mm=offset_mm))
    assert found.path.max_mm == pytest.approx(offset_mm)
    assert found.path.rms_mm == pytest.approx(offset_mm)
    assert found.lag_s == pytest.approx(0.0, abs=1e-6)


def test_the_error_counts_only_while_a_side_moves() -> None:
    """Creeping apart below the threshold is no path error but a positioning error."""
    creeping = reach_and_hold("twin")
    creep = np.clip(creeping.stamps - 2.5, 0.0, None)[:, None] * (0.0, 4e-4, 0.0)
    creeping = dataclasses.replace(
        creeping,
        positions=creeping.positions + creep,
        velocities=creeping.velocities + 4e-4 * (creep > 0.0),
    )
    found = both(reach_and_hold("real"), creeping)
    assert found.path.max_mm < 1e-6
    assert found.positioning_max_mm == pytest.approx(0.4 * (3.995 - 0.02 - 2.5), rel=1e-2)


def test_a_rest_is_measured_against_both_sides_and_the_set_position() -> None:
    """Each side's distance from the set position is given beside their distance from each other."""
    goal = np.array([0.2, 0.0, 0.0])
    found = both(
        reach_and_hold("real", offset=(0.001, 0, 0)),
        reach_and_hold("twin", offset=(-0.002, 0, 0)),
        P2=goal,
    )
    away, held = found.rests
    assert (away.set_position, away.real_error_mm) == (None, None)
    assert (held.set_position, round(held.deviation_mm, 6)) == ("P2", 3.0)
    assert (round(held.real_error_mm or 0, 6), round(held.twin_error_mm or 0, 6)) == (1.0, 2.0)
    assert held.start >= 2.5 - 0.01, "the first half second after the stop is not measured"


@pytest.mark.parametrize("at", [0.3, 0.51])
def test_a_rest_shorter_than_half_a_second_is_not_measured(at: float) -> None:
    """A pause within a program is no set position; nor is one of which nothing would be left."""
    first, second = reach_and_hold("real", at=at), reach_and_hold("twin", at=at)
    assert [rest.start for rest in both(first, second).rests] == [pytest.approx(at + 1.5, abs=0.01)]


def test_the_travelled_path_of_a_move_is_its_length() -> None:
    """Ten millimetres of error on a move of 200 mm are five percent of it."""
    found = both(reach_and_hold("real"), reach_and_hold("twin", offset=(0, 0.01, 0)))
    (move,) = found.moves
    assert move.length_mm == pytest.approx(200.0, rel=1e-4)
    assert found.travelled_percent == pytest.approx(5.0, rel=1e-4)


@pytest.mark.parametrize(
    ("since", "until", "percent"),
    [(0.5, 2.5, pytest.approx(5.0, rel=1e-4)), (0.5, 1.4, None), (1.4, 2.5, None)],
)
def test_a_move_that_the_data_cut_has_no_percent(
    since: float, until: float, percent: float | None
) -> None:
    """Its error would be held against a part of its way: the shorter, the worse."""
    sides = (reach_and_hold("real"), reach_and_hold("twin", offset=(0, 0.01, 0)))
    assert both(*(cut(side, since, until) for side in sides)).travelled_percent == percent


@pytest.mark.parametrize(("pause", "lengths"), [(0.08, [400.0]), (0.12, [200.0, 200.0])])
def test_a_standstill_of_less_than_a_tenth_of_a_second_ends_no_move(
    pause: float, lengths: list[float]
) -> None:
    """As where a program goes on behind a corner."""
    first, second = reach_and_hold("real"), reach_and_hold("real", at=2.0 + pause)
    positions = first.positions + second.positions
    real = Motion("real", first.stamps, positions, first.velocities + second.velocities)
    found = both(real, dataclasses.replace(real, side="twin"))
    assert [move.length_mm for move in found.moves] == pytest.approx(lengths, rel=1e-3)


@pytest.mark.parametrize(
    ("hole", "percents"),
    [
        ((1.9, 2.6), [None, None]),
        ((2.05, 2.45), [5.0, 5.0]),
        ((0.5, 1.5), [None, 5.0]),
        ((1.4, 1.6), [None, None, 5.0]),
    ],
)
def test_a_hole_ends_a_move_and_adds_no_way(
    hole: tuple[float, float], percents: list[float | None]
) -> None:
    """There and back, 10 mm apart: how far who moved in the hole went is not known."""
    first, back = reach_and_hold("real"), reach_and_hold("real", at=2.5)
    real = Motion(
        "real", first.stamps, first.positions - back.positions, first.velocities - back.velocities
    )
    kept = (real.stamps <= hole[0]) | (real.stamps >= hole[1])
    twin = Motion(
        "twin", real.stamps[kept], real.positions[kept] + (0, 0.01, 0), real.velocities[kept]
    )
    found = both(real, twin)
    assert [move.travelled_percent for move in found.moves] == [
        percent and pytest.approx(percent, rel=1e-3) for percent in percents
    ]
    assert sum(move.length_mm for move in found.moves) < 400.1


@pytest.mark.parametrize("begun", [0.0, 1000.0])
def test_a_hole_is_left_out_and_reported(begun: float) -> None:
    """Between samples 0.3 s apart nothing is invented; both sides of the hole are compared."""
    real, twin = wave("real").shifted(begun), wave("twin").shifted(begun)
    keep = (twin.stamps < begun + 3.0) | (twin.stamps > begun + 3.3)
    holed = Motion("twin", twin.stamps[keep], twin.positions[keep] + 0.0, twin.velocities[keep])
    found = both(real, holed)
    (gap,) = found.trace.aligned.gaps
    assert (gap.side, round(gap.start - begun, 2), round(gap.duration, 2)) == ("twin", 3.0, 0.31)
    assert found.path.max_mm < 0.01
    assert found.trace.aligned.span == pytest.approx(8.0, abs=0.02)
    assert found.trace.aligned.excluded_share == pytest.approx(0.31 / 8.0, abs=2e-3)
    (first, cut), (again, last) = found.trace.aligned.segments
    assert (first, cut, last) == (0, again, len(found.trace.aligned.instants))
    assert found.trace.aligned.instants[cut] == pytest.approx(gap.start + gap.duration)


def test_a_clock_that_jumps_ahead_by_years_leaves_one_hole() -> None:
    """Both parts are compared, and no memory is asked for the years between them."""
    sides = [wave(side, seconds=5.0) for side in ("real", "twin")]
    jumped = [
        dataclasses.replace(side, stamps=side.stamps + 3.2e8 * (side.stamps > 2.5))
        for side in sides
    ]
    found = both(*jumped).trace.aligned
    assert [gap.side for gap in found.gaps] == ["real", "twin"] and len(found.segments) == 2
    assert len(found.instants) == pytest.approx(5000, abs=10)


@given(
    st.lists(st.tuples(st.integers(-3, 12), st.integers(1, 60)), max_size=6),
    st.integers(1, 50),
)
def test_the_steps_in_no_hole_are_those_at_known_instants(
    holes: list[tuple[int, int]], count: int
) -> None:
    """Also where holes overlap, meet, or end at a step."""
    gaps = [SampleGap("real", 0.3 + 0.1 * begin, 0.02 * length) for begin, length in holes]
    instants = 0.3 + np.arange(count) / 50.0
    known = np.flatnonzero(known_at(instants, gaps))
    np.testing.assert_array_equal(known_steps(0.3, count, 50.0, gaps), known)


def test_both_sides_are_compared_from_the_later_begin_to_the_sooner_end() -> None:
    """At instants of the rate that is asked for, the first and the last of them included."""
    real, twin = wave("real", seconds=2.0), wave("twin", seconds=3.0, shift=0.5)
    found = align(real, twin, 100.0, 0.1).instants
    assert found[0] == pytest.approx(0.5)
    assert 1.996 - 0.01 < found[-1] <= 1.996 + 1e-9
    assert np.diff(found) == pytest.approx(np.full(len(found) - 1, 0.01))


def test_a_twin_stirs_with_any_of_its_joints() -> None:
    """Long before it counts as moving, and whatever the real robot does."""
    slow = np.full((200, 3), 2e-4) * (0.0, 1.0, 0.0)
    stamps = np.arange(200) / 100.0
    stirs = Motion("", stamps, slow * stamps[:, None], slow)
    still = Motion("", stamps, 0.0 * slow, 0.0 * slow)
    for twin, real in ((stirs, still), (still, stirs)):
        seen = trace(real, twin, identity, SETTINGS)
        assert seen.stirring.all() == (twin is stirs) and not seen.moving.any()


def test_the_worst_move_and_the_worst_rest_count_for_the_whole() -> None:
    """A move without a known way, and a run without rests, give no figure."""
    found = both(wave("real"), wave("twin", delay=0.007))
    move = Move(0.0, 1.0, 100.0, 2.0, None)
    percents = (None, 2.0, 5.0, 3.0)
    moves = tuple(dataclasses.replace(move, travelled_percent=percent) for percent in percents)
    assert dataclasses.replace(found, moves=moves).travelled_percent == 5.0
    assert dataclasses.replace(found, moves=(move,)).travelled_percent is None
    rests = tuple(Rest(0.0, 1.0, apart, None, None, None) for apart in (0.1, 0.4, 0.2))
    assert dataclasses.replace(found, rests=rests).positioning_max_mm == 0.4
    assert dataclasses.replace(found, rests=()).positioning_max_mm is None


@pytest.mark.parametrize(("hole", "counts"), [(1.0, False), (3.0, True), (6.0, False)])
def test_a_hole_counts_where_both_sides_were_recorded(hole: float, counts: bool) -> None:
    """Before and after that time nothing is compared anyway."""
    real, twin = wave("real"), wave("twin")
    both_at = (real.stamps >= 2.0) & (real.stamps <= 5.0)
    kept = (twin.stamps < hole) | (twin.stamps > hole + 0.3)
    sides = (
        Motion(side.side, side.stamps[rows], side.positions[rows], side.velocities[rows])
        for side, rows in ((real, both_at), (twin, kept))
    )
    assert len(align(*sides, 100.0, 0.05).gaps) == int(counts)


def test_the_interpolant_is_exact_for_a_cubic() -> None:
    """Positions and velocities of the samples determine the cubic between them."""
    stamps = np.array([0.0, 0.4, 1.0])
    values, slopes = (stamps**3 - stamps)[:, None], (3.0 * stamps**2 - 1.0)[:, None]
    at = np.linspace(0.0, 1.0, 21)
    positions, velocities = interpolate(Motion("real", stamps, values, slopes), at)
    np.testing.assert_allclose(positions[:, 0], at**3 - at, atol=1e-12)
    np.testing.assert_allclose(velocities[:, 0], 3.0 * at**2 - 1.0, atol=1e-12)


def test_runs_are_cut_where_a_segment_ends() -> None:
    """A rest that is interrupted by a hole is two rests."""
    assert true_runs(np.array([True, True, False, True, True, True]), ((0, 4), (4, 6))) == [
        (0, 2),
        (3, 4),
        (4, 6),
    ]


def test_no_gap_is_found_in_even_samples() -> None:
    """Samples at their rate leave no hole."""
    assert find_gaps(wave("real"), 0.05) == ()


def still(side: str, start: float = 0.0, joints: int = 3) -> Motion:
    """Return a side that stands still for one second."""
    stamps = np.linspace(start, start + 1.0, 101)
    return Motion(side, stamps, np.zeros((101, joints)), np.zeros((101, joints)))


def build(stamps: list[float], rows: int, value: float = 0.0) -> Motion:
    """Return a motion of one joint from raw parts."""
    return Motion("twin", np.array(stamps), np.full((rows, 1), value), np.zeros((rows, 1)))


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: build([], 0), "twin: 0 samples, at least 2"),
        (lambda: build([1.0], 1), "twin: 1 samples, at least 2"),
        (lambda: build([1.0, 2.0], 3), r"twin: 2 stamps, positions \(3, 1\)"),
        (lambda: build([1.0, math.nan], 2), "twin: a stamp is not finite"),
        (lambda: build([1.0, 2.0], 2, math.inf), "twin: a position is not finite"),
        (lambda: build([1.0, 1.0], 2), "twin: stamps do not rise at sample 1"),
        (
            lambda: both(still("real"), still("twin", start=5.0)),
            "no common time span: real has 0.000 to 1.000 s, twin 5.000 to 6.000",
        ),
        (lambda: both(still("real", joints=2), still("twin")), "real has 2 joints, twin 3"),
        (lambda: both(still("real"), still("twin")), "neither side moved"),
        (
            lambda: both(still("real", joints=2), still("twin", joints=2)),
            r"moving_speeds has shape \(3,\)",
        ),
        (
            lambda: align(build([0.0, 9.0], 2), build([0.5, 8.5], 2), 100.0, 0.05),
            "every instant lies in a hole",
        ),
        (lambda: summarize(np.array([]), 650.0), "neither side moved"),
    ],
)
def test_data_that_cannot_be_compared_is_refused(make: object, text: str) -> None:
    """The error names the side and what is wrong with it."""
    with pytest.raises(MetricsError, match=text):
        make()  # type: ignore[operator]


def test_one_side_that_stands_still_has_the_full_error_and_no_lag() -> None:
    """A dead follower is measured, not excused."""
    dead = reach_and_hold("twin")
    found = both(
        reach_and_hold("real"),
        dataclasses.replace(dead, positions=dead.positions * 0, velocities=dead.velocities * 0),
    )
    assert found.path.max_mm == pytest.approx(200.0, rel=1e-2)
    assert found.lag_s is None and found.path_after_lag is None


def test_the_deviation_is_a_distance_in_millimetres() -> None:
    """3-4-5 in the plane."""
    assert deviation_mm(np.array([0.003, 0.0, 0.0]), np.array([0.0, 0.004, 0.0])) == pytest.approx(
        5.0
    )


@pytest.mark.parametrize(
    ("real", "twin", "worst"),
    [(0.001, 0.003, 3.0), (0.003, 0.001, 3.0), (0.002, -0.002, 4.0), (0.0, -0.001, 1.0)],
    ids=["twin", "real", "both apart", "twin alone"],
)
def test_the_positioning_figure_is_the_largest_of_three_distances(
    real: float, twin: float, worst: float
) -> None:
    """Sides from each other, real from the set position, twin from the set position."""
    found = both(
        reach_and_hold("real", offset=(real, 0, 0)),
        reach_and_hold("twin", offset=(twin, 0, 0)),
        P2=np.array([0.2, 0.0, 0.0]),
    )
    assert found.rests[-1].worst_mm == pytest.approx(worst, abs=1e-6)
    assert found.positioning_max_mm == pytest.approx(worst, abs=1e-6)


@pytest.mark.parametrize("leader", ["real", "twin"])
def test_the_lag_is_removed_whoever_leads(leader: str) -> None:
    """Both sides meet half-way: the one that leads comes later, the one that follows sooner."""
    sides = {side: wave(side, delay=0.0 if side == leader else 0.02) for side in ("real", "twin")}
    found = both(sides["real"], sides["twin"], leader)
    assert found.lag_s == pytest.approx(0.02, abs=1e-4)
    assert found.path_after_lag is not None and found.trace_after_lag is not None
    assert found.path_after_lag.max_mm < 0.02 * found.path.max_mm
    shown = found.trace_after_lag.aligned.instants[0] - found.trace.aligned.instants[0]
    assert shown == pytest.approx(0.01, abs=2e-3)


@pytest.mark.parametrize(("leader", "share"), [("real", 1.0), ("twin", 0.5)])
def test_the_way_of_a_move_is_that_of_its_leader(leader: str, share: float) -> None:
    """Who follows goes half as far here, and by that its error would seem twice as large."""
    real, whole = reach_and_hold("real"), reach_and_hold("twin")
    twin = Motion("twin", whole.stamps, 0.5 * whole.positions, 0.5 * whole.velocities)
    (move,) = both(real, twin, leader).moves
    assert move.length_mm == pytest.approx(share * 200.0, rel=1e-2)
    assert move.travelled_percent == pytest.approx(100.0 * 100.0 / move.length_mm, rel=1e-2)


def test_where_nothing_is_missing_all_counts() -> None:
    """There is one instant more than steps between them."""
    found = both(wave("real"), wave("twin"))
    assert found.trace.aligned.excluded_share == 0.0
    assert len(found.moves) == 1


def test_who_says_nothing_gets_the_settings_of_the_shipped_file() -> None:
    """A quantity has one value wherever it is used."""
    shipped = load_experiments(load_robot(), ROOT / "config").metrics
    for name in shipped.__struct_fields__:
        if name != "moving_speed_percent":
            assert getattr(SETTINGS, name) == getattr(shipped, name), name
