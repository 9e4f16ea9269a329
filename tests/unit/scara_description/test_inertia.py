"""Inertia from mass and shapes, against closed forms and against sampling."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scara_description.inertia import ShapeError, inertial_of, rotation_from_rpy, with_inertia
from scipy.spatial.transform import Rotation

BOX = (
    '<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry><box '
    'size="{size}"/></geometry></collision>'
)
CYLINDER = (
    '<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry><cylinder '
    'radius="{radius}" length="{length}"/></geometry></collision>'
)


def link(*shapes: str, mass: float = 2.0) -> ET.Element:
    """Build a link of the given collision shapes."""
    return ET.fromstring(
        f'<link name="part"><inertial><mass value="{mass}"/></inertial>{"".join(shapes)}</link>'
    )


def test_box_has_the_textbook_inertia():
    """I_xx = m (y^2 + z^2) / 12 and so on, about the middle."""
    answer = inertial_of(link(BOX.format(xyz="0 0 0", rpy="0 0 0", size="1 2 3")))
    np.testing.assert_allclose(answer.inertia, np.diag([13.0, 10.0, 5.0]) * 2.0 / 12.0)
    np.testing.assert_allclose(answer.centre, [0.0, 0.0, 0.0])


def test_shape_without_origin_stands_at_the_links_frame():
    """As URDF says; a turned cylinder has its axis where the turn puts it."""
    upright = inertial_of(
        link('<collision><geometry><cylinder radius="1" length="6"/></geometry></collision>')
    )
    np.testing.assert_allclose(upright.inertia, np.diag([6.5, 6.5, 1.0]))
    lying = inertial_of(
        link(CYLINDER.format(xyz="5 6 7", rpy="0 1.5707963267948966 0", radius=1, length=6))
    )
    np.testing.assert_allclose(lying.inertia, np.diag([1.0, 6.5, 6.5]), atol=1e-12)
    np.testing.assert_allclose(lying.centre, [5.0, 6.0, 7.0])


def test_two_halves_are_the_whole():
    """Steiner: a box cut in two has the same mass, centre and inertia."""
    whole = inertial_of(link(BOX.format(xyz="0.1 0 0", rpy="0 0 0", size="0.4 0.2 0.3")))
    halves = [BOX.format(xyz=f"{x} 0 0", rpy="0 0 0", size="0.2 0.2 0.3") for x in (0.0, 0.2)]
    cut = inertial_of(link(*halves))
    np.testing.assert_allclose(cut.centre, whole.centre, atol=1e-15)
    np.testing.assert_allclose(cut.inertia, whole.inertia, atol=1e-15)


def test_turned_shapes_agree_with_sampling():
    """A slanted box beside a slanted cylinder, against points strewn evenly in both."""
    rng, count = np.random.default_rng(8), 200_000
    rpy = (0.3, -0.8, 1.9)
    places = {"box": np.array([0.1, -0.2, 0.3]), "cylinder": np.array([-0.3, 0.1, 0.0])}
    size, radius, length = np.array([0.2, 0.4, 0.3]), 0.1, 0.5
    volumes = {"box": size.prod(), "cylinder": np.pi * radius**2 * length}
    turn, reach = rng.uniform(0.0, 2.0 * np.pi, count), radius * np.sqrt(rng.uniform(size=count))
    in_cylinder = np.column_stack(
        [reach * np.cos(turn), reach * np.sin(turn), rng.uniform(-length / 2, length / 2, count)]
    )
    in_box = rng.uniform(-size / 2, size / 2, (count, 3))
    matrix = Rotation.from_euler("xyz", rpy).as_matrix()
    points = np.vstack(
        [in_box @ matrix.T + places["box"], in_cylinder @ matrix.T + places["cylinder"]]
    )
    share = np.repeat([volumes["box"], volumes["cylinder"]], count)
    weights = 2.0 * share / share.sum()
    centre = weights @ points / 2.0
    arms = points - centre
    expected = (weights @ (arms**2).sum(axis=1)) * np.eye(3) - (weights[:, None] * arms).T @ arms
    texts = {key: " ".join(map(str, place)) for key, place in places.items()}
    angles = " ".join(map(str, rpy))
    answer = inertial_of(
        link(
            BOX.format(xyz=texts["box"], rpy=angles, size="0.2 0.4 0.3"),
            CYLINDER.format(xyz=texts["cylinder"], rpy=angles, radius=radius, length=length),
        )
    )
    np.testing.assert_allclose(answer.centre, centre, atol=2e-3)
    np.testing.assert_allclose(answer.inertia, expected, atol=2e-3)


@pytest.mark.parametrize("rpy", [(0.1, 0.2, 0.3), (np.pi, 0.0, -np.pi / 2), (-2.0, 1.5, 0.7)])
def test_rpy_is_about_fixed_axes(rpy):
    """URDF's convention: roll, then pitch, then yaw, each about the parent's axes."""
    np.testing.assert_allclose(
        rotation_from_rpy(*rpy), Rotation.from_euler("xyz", rpy).as_matrix(), atol=1e-15
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<link name='part'/>", "link part has no mass"),
        (
            "<link name='part'><inertial><mass value='1'/></inertial></link>",
            "link part has no collision shape",
        ),
        (
            "<link name='part'><inertial><mass value='1'/></inertial>"
            "<collision><geometry><mesh filename='a'/></geometry></collision></link>",
            "link part has a collision shape that is neither box nor cylinder",
        ),
    ],
)
def test_link_whose_inertia_is_unknown_is_refused(text, reason):
    """The text names the link."""
    with pytest.raises(ShapeError, match=reason):
        inertial_of(ET.fromstring(text))


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ("<box/>", "<box> has size = '': expected 3 finite numbers above 0"),
        ("<box size='1 2'/>", "<box> has size = '1 2': expected 3 finite numbers above 0"),
        ("<box size='1 2 0'/>", "<box> has size = '1 2 0': expected 3 finite numbers above 0"),
        (
            "<cylinder radius='wide' length='1'/>",
            "<cylinder> has radius = 'wide': expected 1 finite number above 0",
        ),
        (
            "<cylinder radius='nan' length='1'/>",
            "<cylinder> has radius = 'nan': expected 1 finite number above 0",
        ),
    ],
)
def test_number_that_is_none_is_refused(shape, reason):
    """The text names link, element, attribute and value."""
    text = (
        "<link name='part'><inertial><mass value='1'/></inertial>"
        f"<collision><geometry>{shape}</geometry></collision></link>"
    )
    with pytest.raises(ShapeError, match=re.escape(f"link part: {reason}")):
        inertial_of(ET.fromstring(text))


def test_each_link_keeps_its_own_mass_wherever_its_inertial_stands():
    """On the line of its link, behind a tab, on one line, and not what stands in a comment."""
    shape = BOX.format(xyz="0 0 0", rpy="0 0 0", size="1 1 1")
    text = f"""<robot name="r">
  <!-- <inertial><mass value="7"/></inertial> -->
  <link name="a"><inertial><mass value="1"/></inertial>{shape}</link>
  <link name="b">
\t<inertial>
\t\t<mass value="2"/></inertial>{shape}
  </link>
  <link name="c">{shape}<inertial ><mass value="3"/></inertial></link>
</robot>
"""
    written = with_inertia(text)
    masses = [
        (link.get("name"), link.find("inertial/mass").get("value"), len(link.find("inertial")))
        for link in ET.fromstring(written).iter("link")
    ]
    assert masses == [("a", "1", 3), ("b", "2", 3), ("c", "3", 3)]
    assert '<!-- <inertial><mass value="7"/></inertial> -->' in written
    assert with_inertia(written) == written


def test_inertial_that_is_no_links_only_one_is_refused():
    """Nobody could say whose it is."""
    shape = BOX.format(xyz="0 0 0", rpy="0 0 0", size="1 1 1")
    twice = '<inertial><mass value="1"/></inertial>' * 2
    with pytest.raises(ShapeError, match="2 <inertial> in 1 links"):
        with_inertia(f'<robot name="r"><link name="a">{twice}{shape}</link></robot>')


def test_file_keeps_its_text_around_the_inertia():
    """Comments, order and layout stay; a second pass changes nothing."""
    shape = BOX.format(xyz="0 0 1", rpy="0 0 0", size="1 2 3")
    text = f"""<robot name="r">
  <!-- a comment -->
  <link name="frame"/>
  <link name="part">
    {shape}
    <inertial><mass value="12"/></inertial>
  </link>
</robot>
"""
    written = with_inertia(text)
    assert written == text.replace(
        '    <inertial><mass value="12"/></inertial>\n',
        "    <inertial>\n"
        '      <origin xyz="0 0 1" rpy="0 0 0"/>\n'
        '      <mass value="12"/>\n'
        '      <inertia ixx="13" ixy="0" ixz="0" iyy="10" iyz="0" izz="5"/>\n'
        "    </inertial>\n",
    )
    assert with_inertia(written) == written
