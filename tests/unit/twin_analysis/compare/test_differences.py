"""Recordings against each other, held against closed forms."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from harness.workspace import ROOT
from scara_config import load_robot
from scara_control.kinematics.screws import ScrewModel, tool_positions
from twin_analysis.compare.charts import compared_charts
from twin_analysis.compare.config import load_comparison
from twin_analysis.compare.differences import Comparer
from twin_analysis.compare.document import comparison_sentences
from twin_analysis.compare.writer_io import compare_tracks
from twin_experiments.config import load_experiments, metrics_settings
from twin_experiments.metrics.series import Array, MetricsError, Motion
from twin_experiments.metrics.tracks import (
    Mechanism,
    Track,
    along_path,
    distance_from_path,
    first_to_move,
    onset,
)
from twin_experiments.report.record import ENDS_EARLY, cut

ROBOT, EXPERIMENTS, CONFIG = load_robot(), load_experiments(load_robot()), load_comparison()
NAMES = tuple(joint.name for joint in ROBOT.twin_joints)
MECHANISM = Mechanism(
    NAMES,
    tuple(ROBOT.twin_joints),
    (0, 1, 2),
    partial(tool_positions, ScrewModel.from_robot(ROBOT)),
)
FOREIGN = Mechanism(("a", "b", "c", "d"), None, (), None)
SETTINGS = metrics_settings(EXPERIMENTS.metrics, ROBOT)


def comparer(mechanism: Mechanism = MECHANISM) -> Comparer:
    """Return a comparer with the shipped numbers."""
    percent, limits = EXPERIMENTS.metrics.moving_speed_percent, EXPERIMENTS.limits
    return Comparer(mechanism, CONFIG, SETTINGS, percent, limits.excluded_percent)


def motion(
    side: str,
    late: float = 0.0,
    offset: Array | float = 0.0,
    speed: float = 1.0,
    rate: float = 200.0,
) -> Motion:
    """Return a rest, a move of joints 1 and 2 and back, and a rest.

    ``speed`` times as fast, ``late`` [s].
    """
    times = np.arange(0.0, 5.0 / min(speed, 1.0), 1.0 / rate)
    positions, velocities = np.zeros((len(times), 4)), np.zeros((len(times), 4))
    for begin, sign in ((1.0, 1.0), (2.5, -1.0)):
        u = np.clip((times - late - begin / speed) * speed, 0.0, 1.0)
        rise, slope = (
            10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5,
            (30.0 * u**2 - 60.0 * u**3 + 30.0 * u**4) * speed,
        )
        for column, way in ((0, 1.0), (1, -0.8)):
            positions[:, column] += sign * way * rise
            velocities[:, column] += sign * way * slope
    return Motion(side, times, positions + offset, velocities)


def track(label: str = "a", late: float = 0.0, real_late: float = 0.0, **options: float) -> Track:
    """Return a track whose twin is ``late`` [s] behind the real robot."""
    real = motion("real", real_late, **options)
    return Track(label, "x", "real", real, motion("twin", real_late + late, **options))


def test_the_lag_of_the_follower_is_found() -> None:
    """By joints and by the tool, in whole and broken samples."""
    found = comparer().pair(track(late=0.0123))
    assert found.lag_s == pytest.approx(0.0123, abs=2e-4)
    assert found.comparison is not None and found.comparison.lag_s == pytest.approx(
        0.0123, abs=2e-4
    )
    assert found.fidelity.matched_percent > 95.0


def test_joint_errors_are_in_border_units() -> None:
    """A constant offset of 0.005 rad is 0.286 deg, rms and largest; other joints have none."""
    offset = np.array([0.0, 0.0, 0.002, 0.005])
    twin = motion("twin", offset=offset)
    found = comparer().pair(Track("a", "x", "real", motion("real"), twin))
    errors = {joint.name: (joint.unit, joint.rms, joint.max) for joint in found.joints}
    assert errors["table_joint"] == (
        "deg",
        pytest.approx(0.286, abs=1e-3),
        pytest.approx(0.286, abs=1e-3),
    )
    assert errors["joint_3"] == ("mm", pytest.approx(2.0), pytest.approx(2.0))
    assert errors["joint_1"][2] == pytest.approx(0.0, abs=1e-9)
    assert found.mean_distance_mm == pytest.approx(2.0, abs=1e-6), (
        "joint_3 lifts the tool, the table does not move it"
    )


def test_distance_over_time_and_along_the_path_are_of_the_same_motion() -> None:
    """Both begin and end at rest with the same peaks.

    The way of the leader is its path's length.
    """
    found = comparer().pair(track(late=0.02))
    times, over_time = found.over_time
    way, along = found.along_path
    assert found.begun == pytest.approx(1.0, abs=0.1) and times[0] == pytest.approx(
        -found.begun, abs=1e-6
    )
    assert along.max() == pytest.approx(over_time.max(), rel=0.02)
    tool = MECHANISM.places(motion("real", rate=1000.0).positions)
    assert way[-1] == pytest.approx(np.linalg.norm(np.diff(tool, axis=0), axis=1).sum(), rel=1e-3)


@pytest.mark.parametrize("shift", [-0.4, 0.0, 0.7])
def test_a_repeat_that_began_at_another_time_is_the_same(shift: float) -> None:
    """Recordings are lined up by their motion, whatever the clock said."""
    real, twin = comparer().runs(track(), track("b", real_late=shift))
    for run in (real, twin):
        assert run.time_max < 0.01 and run.path_max < 0.05, run
        assert run.fidelity.matched_percent > 99.0 and abs(run.length_percent) < 0.01


def test_a_slower_repeat_is_off_in_time_but_on_the_path() -> None:
    """The path is compared whatever the speed along it."""
    real, _ = comparer().runs(track(), track("b", speed=0.8))
    assert real.time_max > 50.0
    assert real.path_max < 0.05


def test_a_higher_path_is_off_by_its_height() -> None:
    """5 mm up at the tool."""
    up = np.array([0.0, 0.0, 0.005, 0.0])
    lifted = replace(track("b"), twin=motion("twin", offset=up))
    real, twin = comparer().runs(track(), lifted)
    assert real.path_max < 0.05
    assert (twin.path_rms, twin.time_rms) == (
        pytest.approx(5.0, abs=0.01),
        pytest.approx(5.0, abs=0.01),
    )


def test_a_foreign_robot_is_compared_by_its_joints() -> None:
    """No kinematics: distances are those of joint vectors, in SI, without errors of a tool."""
    found = comparer(FOREIGN).pair(track(late=0.01))
    assert found.comparison is None and found.mean_distance_mm is None
    assert found.lag_s == pytest.approx(0.01, abs=2e-4)
    assert {joint.unit for joint in found.joints} == {"rad or m"}
    assert found.fidelity.matched_percent > 90.0


def test_recordings_without_motion_cannot_be_lined_up() -> None:
    """The text names recording and experiment."""
    still = Motion("real", np.arange(0.0, 2.0, 0.01), np.zeros((200, 4)), np.zeros((200, 4)))
    silent = Track("b", "x", "real", still, replace(still, side="twin"))
    with pytest.raises(MetricsError, match="b x: nothing moves"):
        comparer().runs(track(), silent)
    assert comparer().pair(silent).comparison is None


def test_who_moved_first_led() -> None:
    """By the first moving sample; a tie goes to the real robot."""
    speeds = np.full(4, 0.01)
    assert first_to_move(motion("real", 0.1), motion("twin"), speeds) == "twin"
    assert first_to_move(motion("real"), motion("twin"), speeds) == "real"
    assert onset(motion("real"), np.full(4, 100.0)) is None


def test_distance_from_a_polyline_is_that_of_its_nearest_point() -> None:
    """A straight line 0.3 above another, and a place beyond its end."""
    reference = np.stack((np.linspace(0.0, 10.0, 101), np.zeros(101)), axis=1)
    places = np.stack((np.linspace(0.0, 11.0, 23), np.full(23, 0.3)), axis=1)
    found = distance_from_path(places, reference, 100)
    assert found[:20] == pytest.approx(0.3)
    assert found[-1] == pytest.approx(np.hypot(1.0, 0.3))


def test_places_along_a_path_are_at_equal_parts_of_its_length() -> None:
    """Also where the motion rested in between."""
    places, times, length = along_path(MECHANISM, motion("real"), 50, SETTINGS.longest_gap_s)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    straight = np.delete(steps, 24)
    assert straight == pytest.approx(length / 49, rel=1e-3), (
        "all but the one in which the way turns back"
    )
    assert (np.diff(times) > 0.0).all()


def test_the_shipped_file_is_read() -> None:
    """In border units, turned into SI."""
    accepted = load_comparison(ROOT / "config").accepted_of(list(ROBOT.twin_joints))
    assert accepted == pytest.approx([np.radians(0.5), np.radians(0.5), 0.005, np.radians(0.5)])


def test_the_recording_that_the_others_are_held_against_is_named() -> None:
    """Also where its own two sides cannot be compared: they were never there at once."""
    both = track("a")
    first = replace(both, real=cut(both.real, 0.0, 2.2), twin=cut(both.twin, 2.3, 5.0))
    tracks = [first, track("b"), track("c", late=0.01)]
    compared = compare_tracks("x", tracks, comparer())
    assert [pair.track.label for pair in compared.pairs] == ["b", "c"] and compared.reasons
    assert comparison_sentences(compared, "mm")[-1].startswith("x: beside a, the ")


def test_a_foreign_joint_moves_from_a_hundredth_of_the_speed_that_it_reached() -> None:
    """On either side; one that has hardly moved at all has only been noisy."""
    speeds = FOREIGN.moving_speeds((motion("real"), motion("twin", speed=2.0)), 5.0)
    reached = 2.0 * 15.0 / 8.0
    assert speeds == pytest.approx([0.01 * reached, 0.008 * reached, 1e-4, 1e-4], rel=1e-3)


def holed(moved: Motion, begin: float, end: float) -> Motion:
    """Return a motion that nobody recorded from ``begin`` to ``end`` [s]."""
    kept = (moved.stamps <= begin) | (moved.stamps >= end)
    return replace(
        moved,
        stamps=moved.stamps[kept],
        positions=moved.positions[kept],
        velocities=moved.velocities[kept],
    )


def test_a_hole_is_told_and_nothing_is_invented_in_it() -> None:
    """The real side moved while nobody recorded it; the twin stood."""
    twin = motion("twin")
    still = replace(twin, positions=0.0 * twin.positions, velocities=0.0 * twin.velocities)
    real = holed(motion("real"), 1.3, 3.2)
    found = compare_tracks("x", [Track("a", "x", "real", real, still)], comparer())
    (pair,) = found.pairs
    assert "a: 38.0 % of the time has no samples, limit 1 %" in found.reasons[0]
    assert [(gap.side, round(gap.duration, 6)) for gap in pair.gaps] == [("real", 1.9)]
    seconds = len(twin.stamps) / 200.0
    assert pair.fidelity.snapshots[0] < 0.65 * seconds * CONFIG.snapshots_hz


def test_a_clock_that_jumps_ahead_by_years_is_a_hole() -> None:
    """In the way there: the figures are of the time before and after, and no memory is short."""
    whole = track("a")
    real, twin = (
        replace(side, stamps=side.stamps + 3.2e8 * (side.stamps > 1.5))
        for side in (whole.real, whole.twin)
    )
    jumped = replace(whole, label="b", real=real, twin=twin)
    found = compare_tracks("x", [jumped, replace(jumped, label="c")], comparer())
    assert "b: 100.0 % of the time has no samples, limit 1 %" in found.reasons[0]
    assert [gap.side for gap in found.pairs[0].gaps] == ["real", "twin"]
    length = comparer().pair(whole).along_path[0][-1]
    assert found.pairs[0].along_path[0][-1] == pytest.approx(length, rel=0.01)
    assert found.runs[0].path_max < 0.1


def test_a_repeat_is_not_held_against_what_nobody_recorded() -> None:
    """The cubic through a hole in the way there and back is off the path, and nobody was there."""
    first, other = track(), track("b")
    other = replace(other, real=holed(other.real, 1.7, 2.8))
    found = compare_tracks("x", [first, other], comparer())
    assert found.reasons[0].startswith("b: 22.")
    assert found.runs[0].path_max < 0.1


PART = "only a part is recorded"


def test_a_side_that_falls_silent_is_told_and_nothing_is_drawn_behind_it() -> None:
    """The robot goes back while nobody tells where the twin is: no figure is of that."""
    whole = replace(track(), start=0.0, end=5.0)
    silent = replace(whole, label="b", twin=cut(whole.twin, 0.0, 2.0))
    found = compare_tracks("x", [whole, silent], comparer())
    assert found.reasons == (
        "b: 60.0 % of the time has no samples, limit 1 %: no figure says what happened then",
        f"b: not held against a: of b {PART}",
    )
    both, pair = found.pairs
    assert both.gaps == () and both.excluded_percent < 0.2
    assert [(gap.side, gap.start, round(gap.duration, 6)) for gap in pair.gaps] == [
        ("twin", 2.0, 3.0)
    ]
    assert pair.along_path[0][-1] == pytest.approx(0.5 * both.along_path[0][-1], rel=0.01)
    assert found.runs == ()


def test_nothing_is_drawn_on_behind_the_last_sample_of_an_unmarked_recording() -> None:
    """Nobody knows when it ended, so it lacks nothing; its two sides are known for a while."""
    whole = track()
    full, pair = (
        comparer().pair(replace(whole, twin=cut(whole.twin, 0.0, until))) for until in (5.0, 2.0)
    )
    assert pair.excluded_percent == 0.0
    assert pair.along_path[0][-1] == pytest.approx(0.5 * full.along_path[0][-1], rel=0.01)


def test_where_no_place_of_the_path_is_known_of_both_it_is_not_drawn() -> None:
    """The other charts are."""
    found = compare_tracks("x", [track()], comparer())
    assert set(compared_charts(found, MECHANISM)) == {"joints", "distance", "along_path"}
    (pair,) = found.pairs
    nowhere = replace(found, pairs=(replace(pair, along_path=(np.zeros(0), np.zeros(0))),))
    assert set(compared_charts(nowhere, MECHANISM)) == {"joints", "distance"}


@pytest.mark.parametrize("whose", ["a", "b"])
def test_a_recording_that_ended_early_is_held_against_no_other(whose: str) -> None:
    """Part by part of its path it would be elsewhere; nor is any held against it."""
    whole = {label: replace(track(label), start=0.0, end=5.0) for label in "ab"}
    real, twin = (cut(side, 0.0, 2.0) for side in (whole["a"].real, whole["a"].twin))
    whole[whose] = replace(whole[whose], real=real, twin=twin, end=2.0, finished=False)
    found = compare_tracks("x", list(whole.values()), comparer())
    assert found.runs == () and len(found.pairs) == 2
    assert found.reasons == (
        f"{whose}: {ENDS_EARLY}",
        f"b: not held against a: of {whose} {PART}",
    )
    assert [pair.excluded_percent < 0.5 for pair in found.pairs] == [True, True]
