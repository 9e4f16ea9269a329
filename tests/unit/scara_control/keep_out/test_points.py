"""Where the watched points are, by plane geometry."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from harness.pair import HOME, ROBOT, SETUP
from harness.yaml_files import CONFIG
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_config import ConfigError, load_robot
from scara_control.keep_out.body import CELL, _pieces, read_body
from scara_control.keep_out.points import all_positions, positions, speed_points, watched_points

from scara_description.urdf import Shape, link_pose, origin_transform

POINTS = SETUP.points
NAMES = ("fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six")
ROBOTS = {name: load_robot(CONFIG / "robots" / name) for name in NAMES}
BODIES = {name: watched_points(robot) for name, robot in ROBOTS.items()}
MODELS = {name: read_body(robot) for name, robot in ROBOTS.items()}
L1, L2, H = 0.35, 0.30, 0.16
Q = st.tuples(
    st.floats(-2.5, 2.5), st.floats(-2.6, 2.6), st.floats(-0.21, 0.0), st.floats(-3.0, 3.0)
)


@given(q=Q)
def test_the_watched_points_are_where_plane_geometry_puts_them(q: tuple[float, ...]) -> None:
    """Tool and elbow by the closed form."""
    assert [point.name for point in POINTS[:2]] == ["tool", "elbow"]
    tool, elbow = (positions(point, np.array([q]))[0] for point in POINTS[:2])
    a, b = q[0], q[0] + q[1]
    assert tool == pytest.approx(
        [L1 * math.cos(a) + L2 * math.cos(b), L1 * math.sin(a) + L2 * math.sin(b), H + q[2]]
    )
    assert elbow[:2] == pytest.approx([L1 * math.cos(a), L1 * math.sin(a)])
    assert all_positions(POINTS, np.array([q, HOME]))[:, 0] == pytest.approx(
        np.array([positions(point, np.array([q]))[0] for point in POINTS])
    )


@pytest.mark.parametrize("name", NAMES)
@given(shares=st.tuples(*[st.floats(0.0, 1.0)] * 6))
def test_every_shape_of_the_arm_is_within_the_watched_body(
    name: str, shares: tuple[float, ...]
) -> None:
    """In each pose, by the URDF's own chain of frames: corners and middles of all shapes."""
    robot = ROBOTS[name]
    model, points = MODELS[name], BODIES[name]
    joints = robot.twin_joints
    q = [j.lower + share * (j.upper - j.lower) for j, share in zip(joints, shares)]
    values = {joint.name: value for joint, value in zip(joints, q)}
    places = all_positions(points, np.array([q]))[:, 0]
    arm = {joint.name for joint in robot.arm_joints}
    seen = 0
    for link, shapes in model.shapes.items():
        if not arm & {joint.name for joint in model.chain(link)}:
            continue
        own = [k for k, point in enumerate(points) if point.name == link]
        half = np.array([points[k].half for k in own])
        for shape in shapes:
            pose = link_pose(model, link, values) @ origin_transform(shape.xyz, shape.rpy)
            grid = within(shape) @ pose[:3, :3].T + pose[:3, 3]
            away = np.abs(grid[:, None] - places[own]) - half
            assert np.all(np.min(np.max(away, axis=2), axis=1) < 1e-9), (link, shape)
            seen += 1
    assert seen >= 8


@pytest.mark.parametrize("name", NAMES)
def test_a_body_that_turns_about_one_axis_alone_keeps_its_extent_along_it(name: str) -> None:
    """A SCARA's link is as high as it is; one that may lie or stand is held in both."""
    arm = {joint.name for joint in ROBOTS[name].arm_joints}
    for link, shapes in MODELS[name].shapes.items():
        own = [point for point in BODIES[name] if point.name == link]
        if not own or not shapes or not arm & {joint.name for joint in MODELS[name].chain(link)}:
            continue
        grids = [
            within(shape) @ pose[:3, :3].T + pose[:3, 3]
            for shape in shapes
            for pose in [link_pose(MODELS[name], link, {}) @ origin_transform(shape.xyz, shape.rpy)]
        ]
        heights = np.concatenate(grids)[:, 2]
        middles = all_positions(own, np.zeros((1, len(ROBOTS[name].twin_joints))))[:, 0, 2]
        halves = np.array([point.half[2] for point in own])
        held = (float((middles - halves).min()), float((middles + halves).max()))
        if ROBOTS[name].geometry is not None:
            assert held == pytest.approx((heights.min(), heights.max()), abs=1e-9), link
        else:
            assert held[0] < heights.min() + 1e-9 and held[1] > heights.max() - 1e-9, link


@pytest.mark.parametrize("name", NAMES[:3])
def test_a_cylinder_that_turns_about_its_own_direction_is_held_as_slim_as_it_is(name: str) -> None:
    """Turning leaves it where it is: with more around it the arm would be kept from free places."""
    arm, seen = {joint.name for joint in ROBOTS[name].arm_joints}, 0
    for link, shapes in MODELS[name].shapes.items():
        halves = [point.half for point in BODIES[name] if point.name == link]
        for shape in shapes if arm & {joint.name for joint in MODELS[name].chain(link)} else ():
            pose = link_pose(MODELS[name], link, {}) @ origin_transform(shape.xyz, shape.rpy)
            if shape.kind == "cylinder" and abs(pose[2, 2]) == pytest.approx(1.0):
                radius, length = shape.size
                held = pytest.approx((radius, radius, 0.5 * length))
                assert any(half == held for half in halves), (link, shape)
                seen += 1
    assert seen


def within(shape: Shape) -> np.ndarray:
    """Return places of a shape: a grid over a box, rims and axis of a cylinder (m, 3)."""
    steps = np.linspace(-0.5, 0.5, 5)
    if shape.kind == "box":
        grid = np.array(np.meshgrid(steps, steps, steps)).reshape(3, -1).T
        return np.asarray(grid * np.array(shape.size))
    radius, length = shape.size
    round_it = np.linspace(0.0, 2.0 * math.pi, 9)
    return np.array(
        [
            (r * radius * math.cos(a), r * radius * math.sin(a), length * z)
            for a in round_it
            for z in steps
            for r in (0.0, 1.0)
        ]
    )


def test_a_tool_elsewhere_than_that_of_the_body_is_refused() -> None:
    """New lengths with the body of the old ones: the text says where the body's tool is."""
    pose = tuple((*row[:3], 0.497 if k == 0 else row[3]) for k, row in enumerate(ROBOT.home_pose))
    with pytest.raises(
        ConfigError,
        match=r"home_pose: the tool at \(497.0, 0.0, 160.0\) mm: "
        r"Expected \(650.0, 0.0, 160.0\) mm, where tool0 of scara_cell.urdf",
    ):
        watched_points(replace(ROBOT, home_pose=pose))


@pytest.mark.parametrize(
    ("number", "axis", "expected"),
    [
        (1, (0, 0, 1, 0, -0.325, 0), r"\[0, 0, 1, 0, -0.35, 0\]"),
        (1, (0, 0, -1, 0, 0.35, 0), r"\[0, 0, 1, 0, -0.35, 0\]"),
        (2, (0, 0, 0, 0, 0, -1), r"\[0, 0, 0, 0, 0, 1\]"),
    ],
)
def test_an_axis_elsewhere_than_that_of_the_body_is_refused(
    number: int, axis: tuple[float, ...], expected: str
) -> None:
    """Place and sign: the elbow is on joint 2's axis."""
    joints = list(ROBOT.joints)
    joints[number] = replace(joints[number], screw_axis=axis)
    name = joints[number].name
    with pytest.raises(ConfigError, match=rf"{name}.screw_axis = .*: Expected {expected}"):
        watched_points(replace(ROBOT, joints=joints))


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            r'<link name="link_2">.*?</link>',
            '<link name="link_2"/>',
            "no <collision> of what joint_2",
        ),
        ("<box size=", "<mesh filename=", "cannot be read: a shape of kind mesh .* box, cylinder"),
        ("tool0", "tool1", "cannot be read: no link 'tool0'"),
        ('name="joint_3"', 'name="joint_9"', "joint_3: is missing"),
        ("</robot>", "", "cannot be read: .*no XML"),
    ],
)
def test_a_body_that_cannot_be_watched_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, text: str
) -> None:
    """Without shapes, tool, joint or sense nothing would be seen of the arm."""
    urdf = tmp_path / "changed.urdf"
    urdf.write_text(re.sub(old, new, ROBOT.description.read_text(), flags=re.DOTALL))
    monkeypatch.setattr(type(ROBOT), "description", urdf)
    with pytest.raises(ConfigError, match=rf"scara_cell.urdf: {text}"):
        watched_points(ROBOT)


@pytest.mark.parametrize("cells", [1, 2, 3, 4, 7])
def test_a_box_that_is_just_so_many_cells_long_is_cut_into_as_many(cells: int) -> None:
    """Whatever rounding makes of its length; a hair more is a piece more."""
    for longer, pieces in ((0.0, cells), (1e-6, cells + 1)):
        box = Shape("box", (cells * CELL + longer, 0.02, 0.01), (0, 0, 0), (0, 0, 0), "")
        assert len(list(_pieces(np.eye(4), box, 2))) == pieces


@pytest.mark.parametrize("name", NAMES)
def test_the_speeds_that_count_are_those_of_the_tool_and_of_the_axes(name: str) -> None:
    """Not of the body around them, which is looked at where it is."""
    points = BODIES[name]
    counted = speed_points(points)
    assert counted[0].name == "tool" and not any(any(point.half) for point in counted)
    assert all(any(point.half) for point in points if point not in counted)
    names = [point.name for point in counted]
    assert names.count("elbow") == (ROBOTS[name].geometry is not None), "only a SCARA has one"
