"""The cell in the picture is the cell of the robot description."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.workspace import ROOT
from scara_config import load_robot
from scipy.spatial.transform import Rotation

from scara_description.urdf import (
    UrdfError,
    joint_transform,
    link_pose,
    origin_transform,
    parse_urdf,
)

TEXT = (ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf").read_text(encoding="utf-8")
MODEL = parse_urdf(TEXT)
ROBOT = load_robot(ROOT / "config")


def one_link(visual: str) -> str:
    """Write a description of a single link."""
    return f'<robot name="r"><link name="a">{visual}</link></robot>'


def test_home_pose_of_the_tool_is_that_of_the_robot_profile() -> None:
    """The ghost stands where the kinematics say."""
    np.testing.assert_allclose(link_pose(MODEL, "tool0", {}), np.array(ROBOT.home_pose), atol=1e-9)


@pytest.mark.parametrize("q", [(0.3, -0.7, -0.05), (-2.0, 2.5, -0.21), (1.1, 0.0, 0.0)])
def test_tool_position_agrees_with_the_closed_form(q: tuple[float, float, float]) -> None:
    """Plane geometry: x = L1 c1 + L2 c12, y = L1 s1 + L2 s12, z = h + q3."""
    pose = link_pose(MODEL, "tool0", dict(zip(("joint_1", "joint_2", "joint_3"), q)))
    x, y = (
        0.35 * math.cos(q[0]) + 0.3 * math.cos(q[0] + q[1]),
        0.35 * math.sin(q[0]) + 0.3 * math.sin(q[0] + q[1]),
    )
    np.testing.assert_allclose(pose[:3, 3], (x, y, 0.16 + q[2]), atol=1e-9)


def test_table_turns_its_stands_and_not_the_tool() -> None:
    """The first stand is below P1 at 0 and on the other side of the table's axis at 180 degrees."""
    at = [link_pose(MODEL, "stand_1", {"table_joint": angle})[:2, 3] for angle in (0.0, math.pi)]
    axis = link_pose(MODEL, "table_link", {})[:2, 3]
    np.testing.assert_allclose(at[0], (0.65, 0.0), atol=1e-9)
    np.testing.assert_allclose(0.5 * (at[0] + at[1]), axis, atol=1e-9)


@pytest.mark.parametrize("rpy", [(0.1, 0.2, 0.3), (-1.0, 0.5, 2.0), (0.0, 1.5707963, 0.0)])
def test_origin_turns_about_fixed_axes_in_the_order_of_urdf(
    rpy: tuple[float, float, float],
) -> None:
    """Roll, then pitch, then yaw, each about the parent's axes; scipy says the same."""
    np.testing.assert_allclose(
        origin_transform((0, 0, 0), rpy)[:3, :3],
        Rotation.from_euler("xyz", rpy).as_matrix(),
        atol=1e-12,
    )


def test_parents_come_before_their_children() -> None:
    """The picture is built in this order."""
    placed = {MODEL.root}
    for joint in MODEL.joints:
        assert joint.parent in placed
        placed.add(joint.child)
    assert placed == set(MODEL.shapes)


def test_joint_slides_along_its_axis() -> None:
    """joint_3 goes up for positive values."""
    (joint,) = [joint for joint in MODEL.joints if joint.name == "joint_3"]
    moved = joint_transform(joint, 0.1) - joint_transform(joint, 0.0)
    np.testing.assert_allclose(moved[:3, 3], (0.0, 0.0, 0.1), atol=1e-12)


@pytest.mark.parametrize(
    ("visual", "kind", "size"),
    [
        ('<visual><geometry><box size="1 2 3"/></geometry></visual>', "box", (1.0, 2.0, 3.0)),
        (
            '<visual><geometry><cylinder radius="1" length="2"/></geometry></visual>',
            "cylinder",
            (1.0, 2.0),
        ),
        ('<visual><geometry><sphere radius="0.5"/></geometry></visual>', "sphere", (0.5,)),
    ],
)
def test_shape_without_origin_and_material_is_grey_in_the_middle(
    visual: str, kind: str, size: tuple[float, ...]
) -> None:
    """URDF's defaults."""
    (shape,) = parse_urdf(one_link(visual)).shapes["a"]
    assert (shape.kind, shape.size, shape.xyz, shape.rpy, shape.colour) == (
        kind,
        size,
        (0, 0, 0),
        (0, 0, 0),
        "#b0b0b0",
    )


def test_colours_are_those_of_the_named_materials() -> None:
    """The arms are yellow, as in the article."""
    assert {shape.colour for shape in MODEL.shapes["link_2"]} >= {"#fac20d", "#1a54cc"}


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("<robot", "no XML"),
        (one_link('<visual><geometry><mesh filename="x"/></geometry></visual>'), "kind mesh"),
        (one_link("<visual/>"), "no geometry"),
        (one_link('<visual><geometry><box size="1 2"/></geometry></visual>'), "'1 2' is no vector"),
        (
            one_link('<visual><geometry><sphere radius="x"/></geometry></visual>'),
            "sphere radius = 'x': Expected a finite number",
        ),
        (
            one_link('<visual><geometry><cylinder radius="nan" length="1"/></geometry></visual>'),
            "cylinder radius = 'nan': Expected a finite number",
        ),
        ('<robot name="r"><link name="a"/><link name="b"/></robot>', "no tree"),
        (
            '<robot name="r"><link name="a"/><link name="b"/><link name="c"/>'
            '<joint name="i" type="fixed"><parent link="b"/><child link="c"/></joint>'
            '<joint name="j" type="fixed"><parent link="c"/><child link="b"/></joint></robot>',
            "i, j form a ring",
        ),
    ],
)
def test_description_that_cannot_be_shown_is_refused(text: str, what: str) -> None:
    """The node ends with this text instead of showing half a robot."""
    with pytest.raises(UrdfError, match=what):
        parse_urdf(text)


def test_unknown_link_is_named_with_those_that_exist() -> None:
    """A wrong tool frame in robot.yaml is found."""
    with pytest.raises(UrdfError, match=r"no link 'tool1': there are base_link"):
        MODEL.chain("tool1")
