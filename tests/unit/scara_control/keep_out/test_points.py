"""Where the watched points are, by plane geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.pair import HOME, ROBOT, SETUP
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_config import ConfigError
from scara_control.keep_out.points import all_positions, positions, watched_points

POINTS = SETUP.points
L1, L2, H = 0.35, 0.30, 0.16
Q = st.tuples(
    st.floats(-2.5, 2.5), st.floats(-2.6, 2.6), st.floats(-0.21, 0.0), st.floats(-3.0, 3.0)
)


@given(q=Q)
def test_the_watched_points_are_where_plane_geometry_puts_them(q: tuple[float, ...]) -> None:
    """Tool and elbow by the closed form; the points of a link are on its straight line."""
    tool, elbow = (positions(point, np.array([q]))[0] for point in POINTS[:2])
    a, b = q[0], q[0] + q[1]
    assert tool == pytest.approx(
        [L1 * math.cos(a) + L2 * math.cos(b), L1 * math.sin(a) + L2 * math.sin(b), H + q[2]]
    )
    assert elbow[:2] == pytest.approx([L1 * math.cos(a), L1 * math.sin(a)])
    for point in POINTS[2:]:
        link, place = point.name.split(" at ")
        along = float(place.removesuffix(" mm")) * 1e-3
        begin, direction = (np.zeros(2), a) if link == "arm" else (elbow[:2], b)
        on_link = begin + along * np.array([math.cos(direction), math.sin(direction)])
        assert positions(point, np.array([q]))[0] == pytest.approx([*on_link, elbow[2]])
    assert all_positions(POINTS, np.array([q, HOME]))[:, 0] == pytest.approx(
        np.array([positions(point, np.array([q]))[0] for point in POINTS])
    )


def test_a_point_on_a_joint_that_moves_no_tool_is_refused() -> None:
    """The text names the point and the joints that carry points."""
    wrong = replace(
        ROBOT, watched_points=[replace(ROBOT.watched_points[0], carried_by="table_joint")]
    )
    with pytest.raises(
        ConfigError,
        match=r"watched_points.tool.carried_by = table_joint: Expected joint_1, joint_2, joint_3",
    ):
        watched_points(wrong)
