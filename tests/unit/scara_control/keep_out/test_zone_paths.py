"""Paths of the watched points and keep-out boxes.

Nothing slips between two samples, and who is inside may only leave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from harness.pair import HOME, SETUP
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_config import KeepOut
from scara_control.keep_out import zones
from scara_control.keep_out.points import FloatArray, WatchedPoint, all_positions
from scara_control.keep_out.zones import (
    entered,
    first_hit,
    free_part,
    heads_into,
    judge_way,
    stands_in,
)

POINTS = SETUP.points
Q = st.tuples(
    st.floats(-2.5, 2.5), st.floats(-2.6, 2.6), st.floats(-0.21, 0.0), st.floats(-3.0, 3.0)
)
ZONE = KeepOut("box", (400.0, -50.0, -100.0), (500.0, 50.0, 400.0))


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ([(0.3, 0.0, 0.0), (0.39, 0.0, 0.0)], False),
        ([(0.3, 0.0, 0.0), (0.45, 0.0, 0.0), (0.6, 0.0, 0.0)], True),
        ([(0.45, 0.0, 0.0), (0.6, 0.0, 0.0)], False),
        ([(0.45, 0.0, 0.0), (0.46, 0.0, 0.0)], False),
        ([(0.45, 0.0, 0.0), (0.6, 0.0, 0.0), (0.45, 0.0, 0.0)], True),
        ([(0.45, 0.06, 0.5), (0.45, 0.06, 0.0)], False),
        ([(0.45, 0.0, 0.5), (0.45, 0.06, 0.0)], True),
        ([(0.3, 0.0, 0.0), (0.6, 0.0, 0.0)], True),
        ([(0.3, 0.0, 0.0), (0.45, 0.15, 0.0), (0.6, 0.0, 0.0)], False),
        ([(0.3, 0.0, 0.0), (0.4, 0.0, 0.0)], True),
    ],
)
def test_a_zone_may_be_left_but_not_entered(
    path: list[tuple[float, float, float]], found: bool
) -> None:
    """Its faces belong to it; who is inside may move inside and out, not in again."""
    text = entered("tool", np.array(path), [ZONE])
    assert bool(text) is found
    if found:
        assert text.startswith("the tool would enter keep-out zone box at (")


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ([(0.41, 0.0, 0.0), (0.45, 0.0, 0.0)], "would go deeper into"),
        ([(0.41, 0.0, 0.0), (0.4109, 0.0, 0.0)], ""),
        ([(0.41, 0.0, 0.0), (0.4111, 0.0, 0.0)], "would go deeper into"),
        ([(0.41, 0.0, 0.0), (0.41, 0.03, 0.0), (0.35, 0.0, 0.0)], ""),
        ([(0.41, 0.0, 0.0), (0.39, 0.0, 0.0), (0.6, 0.0, 0.0)], "would enter"),
    ],
)
def test_who_is_in_a_zone_may_only_leave_it(
    path: list[tuple[float, float, float]], found: str
) -> None:
    """Not deeper, not in again between two samples; noise is no motion."""
    assert (
        found in entered("tool", np.array(path), [ZONE])
        if found
        else not entered("tool", np.array(path), [ZONE])
    )


def test_where_a_point_goes_deeper_is_told() -> None:
    """The first place that is deeper than what was reached, not the deepest."""
    path = np.array([(0.41, 0.0, 0.0), (0.42, 0.0, 0.0), (0.44, 0.0, 0.0)])
    assert entered("tool", path, [ZONE]).endswith("zone box at (420, 0, 0) mm")
    far = KeepOut("far", (3000.0, -2000.0, 1000.0), (3500.0, -1000.0, 2000.0))
    path = np.array([(3.01, -1.1, 1.2), (3.024, -1.111, 1.2), (3.03, -1.2, 1.2)])
    assert entered("tool", path, [far]).endswith("zone far at (3024, -1111, 1200) mm")


def test_who_stands_on_a_face_may_go_along_it_and_away() -> None:
    """A part that lies on a table's zone is in it by nothing; inwards is deeper."""
    on = [(0.4, 0.0, 0.0), (0.4, 0.03, 0.1), (0.4, -0.03, 0.2)]
    assert entered("tool", np.array(on), [ZONE]) == ""
    assert entered("tool", np.array([*on, (0.3, 0.0, 0.0)]), [ZONE]) == ""
    assert "would go deeper into" in entered("tool", np.array([*on, (0.45, 0.0, 0.0)]), [ZONE])


@pytest.mark.parametrize(
    ("left", "right", "found"),
    [
        (600.0, 900.0, "the tool stands 30 mm deep in keep-out zone box"),
        (340.0, 645.0, "the elbow stands 10 mm deep in keep-out zone box"),
        (340.0, 665.0, "the tool stands 15 mm deep in keep-out zone box"),
        (649.2, 900.0, ""),
        (648.8, 900.0, "the tool stands 1 mm deep in keep-out zone box"),
        (651.0, 900.0, ""),
    ],
)
def test_who_stands_in_a_zone_is_told_with_the_deepest_point(
    left: float, right: float, found: str
) -> None:
    """Stretched out the tool is at (650, 0, 160) mm, the elbow at (350, 0, 160); noise is none."""
    points = [replace(point, half=(0.0, 0.0, 0.0)) for point in POINTS[:2]]
    apart = [KeepOut("far", (0.0, 500.0, 0.0), (90.0, 600.0, 90.0))]
    zone = KeepOut("box", (left, -70.0, 130.0), (right, 70.0, 400.0))
    assert stands_in(points, [*apart, zone], (0.0, 0.0, 0.0, 0.0)) == found


def test_the_first_hit_is_on_the_piece_that_meets_the_box() -> None:
    """Behind a corner too."""
    path = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)])
    hit = first_hit(path, np.array([0.9, 0.4, -0.1]), np.array([1.1, 0.6, 0.1]))
    assert hit == pytest.approx([1.0, 0.4, 0.0])


def test_a_place_that_is_no_number_ends_the_leave_to_be_in_a_zone() -> None:
    """What comes behind it is judged like anybody who comes from outside."""
    nowhere = (math.nan, math.nan, math.nan)
    path = [(0.401, 0.0, 0.0), nowhere, (0.44, 0.0, 0.0), (0.45, 0.0, 0.0)]
    assert "would enter" in entered("tool", np.array(path), [ZONE])


@given(ends=st.lists(st.tuples(*[st.floats(-0.2, 0.8)] * 3), min_size=2, max_size=4))
def test_a_polyline_meets_a_box_where_fine_samples_do(
    ends: list[tuple[float, float, float]],
) -> None:
    """The slabs against 2000 samples of each part; a touch between two samples is allowed."""
    path, lower, upper = (
        np.array(ends),
        np.array(ZONE.lower_mm) * 1e-3,
        np.array(ZONE.upper_mm) * 1e-3,
    )
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    fine = np.concatenate([a + share * (b - a) for a, b in pairwise(path)])
    off = np.max(np.maximum(lower - fine, fine - upper), axis=1)
    hit = first_hit(path, lower, upper)
    if hit is not None:
        assert np.max(np.maximum(lower - hit, hit - upper)) <= 1e-9 and off.min() < 1e-3
    else:
        assert off.min() > 0.0


def test_a_way_between_two_free_ends_is_judged_in_between() -> None:
    """From one side of the zone to the other, both ends free."""
    start, end = (0.6, 0.0, -0.1, 0.0), (-0.6, 0.0, -0.1, 0.0)
    in_front = KeepOut("post", (600.0, -30.0, -1000.0), (700.0, 30.0, 1000.0))
    assert not judge_way(POINTS, [in_front], start, start, SETUP.velocity).violation
    assert "post" in judge_way(POINTS, [in_front], start, end, SETUP.velocity).violation
    assert not judge_way(POINTS, [], start, end, SETUP.velocity).violation


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        ((1.0, 0.0, -0.16, 0.0), 0.65 * math.radians(440.0)),
        ((0.0, 1.0, -0.16, 0.0), 0.30 * math.radians(700.0)),
        ((0.0, 0.0, -0.06, 0.0), 2.0),
        ((0.0, 0.0, -0.16, 1.0), 0.0),
        (HOME, 0.0),
    ],
)
def test_peak_speed_of_a_move_of_one_joint(end: tuple[float, ...], expected: float) -> None:
    """Radius times the joint's largest speed; the table moves no point of the arm."""
    assert judge_way(POINTS, [], HOME, end, SETUP.velocity).peak_speed == pytest.approx(
        expected, rel=1e-3, abs=1e-9
    )


def test_a_path_that_ends_on_a_face_meets_the_box_at_its_end() -> None:
    """No chord begins there."""
    path = np.array([(0.2, 0.0, 0.0), (0.3, 0.0, 0.0), (0.4, 0.0, 0.0)])
    hit = first_hit(path, np.array(ZONE.lower_mm) * 1e-3, np.array(ZONE.upper_mm) * 1e-3)
    assert hit == pytest.approx((0.4, 0.0, 0.0))


@pytest.mark.parametrize("angle", np.linspace(0.3, 2.0, 18))
@pytest.mark.parametrize("thick", [5.0, 20.0])
def test_a_thin_post_is_not_missed(angle: float, thick: float) -> None:
    """Wherever on the tool's circle it stands, and 65 samples 50 mm apart would pass it by."""
    x, y = 650.0 * math.cos(angle), 650.0 * math.sin(angle)
    post = KeepOut(
        "post", (x - thick / 2, y - thick / 2, -1000.0), (x + thick / 2, y + thick / 2, 1000.0)
    )
    assert (
        "post"
        in judge_way(
            POINTS, [post], (-2.5, 0.0, -0.1, 0.0), (2.5, 0.0, -0.1, 0.0), SETUP.velocity
        ).violation
    )


@given(start=Q, end=Q)
def test_the_quick_look_finds_what_the_whole_way_shows(
    start: tuple[float, ...], end: tuple[float, ...]
) -> None:
    """The same point enters the same zone; where on the way differs by the two grids."""
    zones = (ZONE, *SETUP.keep_out)
    quick = heads_into(POINTS, zones, start, end)
    whole = judge_way(POINTS, zones, start, end, SETUP.velocity).violation
    assert quick.partition(" at ")[0] == whole.partition(" at ")[0]


@pytest.mark.parametrize("radius", np.arange(0.15, 0.66, 0.05))
def test_a_stretched_arm_sweeps_no_post_unnoticed(radius: float) -> None:
    """80 mm wide, wherever along the two links it stands."""
    x, y, half = 1e3 * radius * math.cos(0.7), 1e3 * radius * math.sin(0.7), 40.0
    post = KeepOut("post", (x - half, y - half, -1000.0), (x + half, y + half, 1000.0))
    found = judge_way(
        POINTS, [post], (0.0, 0.0, -0.16, 0.0), (1.4, 0.0, -0.16, 0.0), SETUP.velocity
    ).violation
    assert "keep-out zone post" in found


@pytest.mark.parametrize("half_sweep", [0.7, 0.9, 1.1])
def test_a_zone_that_only_the_arcs_bulge_enters_is_found(half_sweep: float) -> None:
    """The path is cut so finely that half a millimetre of the arc is seen, wherever it is."""
    start, end = (-half_sweep, 0.0, -0.1, 0.0), (half_sweep, 0.0, -0.1, 0.0)
    missed = []
    for angle in np.linspace(-0.05, 0.05, 21):
        # A pillar beside the stretched arm's circle of 650 mm; it enters by half a millimetre.
        x, y = 650.0 * math.cos(angle), 650.0 * math.sin(angle)
        pillar = KeepOut("pillar", (x - 0.5, y - 0.5, -1000.0), (x + 50.0, y + 0.5, 1000.0))
        if not judge_way(POINTS, [pillar], start, end, SETUP.velocity).violation:
            missed.append(angle)
    assert not missed


def short_pieces(start: tuple[float, ...], number: int) -> list[tuple[float, ...]]:
    """Return corners of a way of a millimetre or two each that comes to ``start``."""
    return [(start[0] - 2e-3 * k, *start[1:]) for k in range(number, 0, -1)]


@pytest.mark.parametrize("half_sweep", [0.3, 0.6, 0.74, 0.79, 1.2, 2.4])
@pytest.mark.parametrize("pieces", [1, 2, 3, 8, 9])
@pytest.mark.parametrize("quarter", range(4))
def test_the_quick_look_sees_a_zone_that_only_a_bulge_enters(
    pieces: int, half_sweep: float, quarter: int
) -> None:
    """To and fro past a pillar that the arc enters by 2 mm, half way between two corners.

    Behind as many short pieces; each of those is short enough as it is.
    """
    middle = quarter * math.pi / 2.0
    corners = [(middle + (-1) ** k * half_sweep, 0.0, -0.1, 0.0) for k in range(pieces + 1)]
    corners[:0] = short_pieces(corners[0], pieces)
    ahead = np.round((math.cos(middle), math.sin(middle), 0.0))
    half = np.abs(ahead) * 26.0 + (1.0 - np.abs(ahead)) * 3.0
    half[2] = 1000.0
    low, high = 674.0 * ahead - half, 674.0 * ahead + half
    pillar = KeepOut("pillar", tuple(low.tolist()), tuple(high.tolist()))
    assert "pillar" in heads_into(POINTS, [pillar], *corners)


@pytest.mark.parametrize("turn", [0.1, 0.7, 4.0])
@pytest.mark.parametrize(("pieces", "short"), [(1, 0), (3, 0), (8, 0), (1, 60)])
def test_a_way_is_looked_at_no_more_closely_than_it_has_to_be(
    pieces: int, short: int, turn: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """This is done at each sample: few places far from zones, near one those of its length.

    Short pieces, as those of what the robot does next, are not cut because a long one is.
    """
    places: list[int] = []

    def counted(points: Sequence[WatchedPoint], q: FloatArray) -> FloatArray:
        places.append(len(q))
        return all_positions(points, q)

    monkeypatch.setattr(zones, "all_positions", counted)
    corners = [((-1) ** k * 0.5 * turn, 0.0, -0.1, 0.0) for k in range(pieces + 1)]
    corners[:0] = short_pieces(corners[0], short)
    unknown = [replace(point, rates=None) for point in POINTS]
    far = KeepOut("far", (5000.0, 5000.0, 5000.0), (6000.0, 6000.0, 6000.0))
    assert not heads_into(unknown, [far], *corners)
    assert sum(places) <= max(8 + pieces, (pieces + short) * (1.0 + turn / 1.5)) + 1
    places.clear()
    near = KeepOut("near", (648.0, -3.0, -1000.0), (700.0, 3.0, 1000.0))
    assert heads_into(unknown, [near], *corners)
    length = 0.65 * turn * pieces
    assert max(places) <= 1.5 * length / 0.01 + 8 + 2 * pieces + short * (1.0 + turn / 1.5)


def test_a_margin_is_kept_only_where_one_is_asked_for() -> None:
    """Half a millimetre beside a zone a way is free, and nearer than a millimetre."""
    ways = (-0.5, 0.0, -0.1, 0.0), (0.5, 0.0, -0.1, 0.0)
    beside = KeepOut("wall", (650.5, -1000.0, -1000.0), (700.0, 1000.0, 1000.0))
    tool = POINTS[:1]
    assert judge_way(tool, [beside], *ways, SETUP.velocity).violation == ""
    found = judge_way(tool, [beside], *ways, SETUP.velocity, 1.0).violation
    assert "come nearer than 1 mm to keep-out zone wall" in found


def test_a_way_within_a_zone_is_free_to_its_end() -> None:
    """Who is in a zone may leave it, and this one has not come out yet."""
    around = KeepOut("around", (-1000.0, -1000.0, -1000.0), (1000.0, 1000.0, 1000.0))
    assert free_part(POINTS, [around], (0.0, 0.0, -0.1, 0.0), (0.5, 0.0, -0.1, 0.0)) == 1.0


@pytest.mark.parametrize("angle", [0.3, 0.9, 1.5])
def test_the_free_part_of_a_way_ends_at_the_face_of_the_first_zone(angle: float) -> None:
    """A little less is free, a little more is not; behind a nearer zone a further one is hidden."""

    def post(at: float) -> KeepOut:
        x, y = 650.0 * math.cos(at), 650.0 * math.sin(at)
        return KeepOut("post", (x - 20.0, y - 20.0, -1000.0), (x + 20.0, y + 20.0, 1000.0))

    start, end = np.array((0.0, 0.0, -0.1, 0.0)), np.array((1.8, 0.0, -0.1, 0.0))
    zones = [post(1.7), post(angle)]
    part = free_part(POINTS, zones, tuple(start), tuple(end))
    assert 0.0 < part < angle / 1.8
    for more, entered_zone in ((-2e-4, False), (2e-4, True)):
        there = start + (part + more) * (end - start)
        assert bool(heads_into(POINTS, zones, tuple(start), tuple(there))) is entered_zone


@pytest.mark.parametrize("turns", [1e7, 1e12])
def test_a_target_of_many_turns_is_judged_in_few_steps(turns: float) -> None:
    """A message may name any number; whoever judges it has no time for so many chords."""
    home = SETUP.home
    way = judge_way(POINTS, [ZONE], home, (turns, *home[1:]), SETUP.velocity)
    assert way.target == (turns, *home[1:])


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_boxes_around_paths_lose_no_zone_at_their_edge(axis: int, side: float) -> None:
    """A tenth of a millimetre is enough, however far out it is."""
    path = np.zeros((1, 2, 3))
    path[0, :, axis] = side * 0.6
    for depth_mm, close in ((0.1, True), (-0.1, False)):
        low, high = np.full(3, -2000.0), np.full(3, 2000.0)
        (low if side > 0.0 else high)[axis] = side * (610.0 - depth_mm)
        zone = KeepOut("wall", tuple(low), tuple(high))
        assert zones._near(path, [zone], np.full((1, 3), 0.01))[0] == close


def test_each_piece_of_a_way_is_cut_by_the_largest_turn_of_any() -> None:
    """Not by how far it is from where the way began."""
    rows = np.array([[0.0, 0.0], [-6.0, 3.0], [6.0, -3.0]])
    assert zones._fewest_steps(rows).tolist() == [12, 12]
