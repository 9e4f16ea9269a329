"""The real robot's description is the moving half of the twin's, with frames of its own."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from harness.workspace import ROOT
from scara_description.ghost import COLOUR, PREFIX, DescriptionError, ghost_of

from scara_description.urdf import link_pose, parse_urdf

URDFS = sorted((ROOT / "src" / "scara_description" / "urdf").glob("*.urdf"))


@pytest.mark.parametrize("urdf", URDFS, ids=lambda path: path.stem)
def test_ghost_moves_as_the_robot_does(urdf: Path) -> None:
    """Same joints, same poses; every frame but the root is another one."""
    text = urdf.read_text(encoding="utf-8")
    robot, ghost = parse_urdf(text), parse_urdf(ghost_of(text))
    assert [joint.name for joint in ghost.joints] == [joint.name for joint in robot.joints]
    assert ghost.root == robot.root
    q = {joint.name: 0.1 * (index + 1) for index, joint in enumerate(robot.joints)}
    for link in set(robot.shapes) - {robot.root}:
        assert link_pose(ghost, PREFIX + link, q).tolist() == link_pose(robot, link, q).tolist()
    assert set(robot.shapes) & set(ghost.shapes) == {robot.root}


@pytest.mark.parametrize("urdf", URDFS, ids=lambda path: path.stem)
def test_ghost_shows_only_what_moves_in_one_colour(urdf: Path) -> None:
    """The floor stands there once; nothing of the ghost is solid for a physics engine."""
    text = urdf.read_text(encoding="utf-8")
    moving = {joint.child for joint in parse_urdf(text).joints if joint.moves}
    tree = ElementTree.fromstring(ghost_of(text))
    assert not list(tree.iter("collision")) and not list(tree.iter("inertial"))
    assert {element.get("rgba") for element in tree.iter("color")} == {COLOUR}
    shown = {
        link.get("name", "").removeprefix(PREFIX)
        for link in tree.iter("link")
        if link.find("visual") is not None
    }
    assert moving <= shown and parse_urdf(text).root not in shown


def test_shapes_of_the_ghost_are_a_hair_smaller() -> None:
    """Where both robots agree, the ghost is inside the twin."""
    text = """<robot name="r"><link name="a"/><link name="b">
    <visual><geometry><box size="0.1 0.2 0.0004"/></geometry></visual>
    <visual><geometry><cylinder radius="0.02" length="0.3"/></geometry></visual></link>
    <joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""
    box, cylinder = parse_urdf(ghost_of(text)).shapes["real/b"]
    assert box.size == pytest.approx((0.099, 0.199, 0.0002))
    assert cylinder.size == pytest.approx((0.0195, 0.299))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("<robot", "is no XML"),
        (
            '<robot name="r"><link name="a"/><link name="b"/></robot>',
            "must have one root, it has a, b",
        ),
        ('<robot name="r"/>', "must have one root, it has none"),
    ],
)
def test_description_that_is_no_tree_is_refused(text: str, why: str) -> None:
    """The text says what is wrong."""
    with pytest.raises(DescriptionError, match=why):
        ghost_of(text)
