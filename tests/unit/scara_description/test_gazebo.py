"""The elements for Gazebo stand where its parsers look, and say what the configuration says."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from harness.workspace import ROOT
from scara_config import load, load_robot, locate
from scara_description.frames import frames_of
from scara_description.ghost import ghost_of
from scara_simulation.camera.config import load_camera

from scara_description.gazebo import CameraView, GazeboError, with_gazebo
from scara_description.urdf import parse_urdf, without_world

CONFIG = ROOT / "config"
VIEW = load(locate("camera.yaml", CONFIG), CameraView)
PLAIN = '<robot name="r">\n  <link name="base"/>\n</robot>\n'


def elements(text: str) -> tuple[ET.Element, ET.Element]:
    """Return the elements of the controller and of the camera."""
    controller, camera = ET.fromstring(text).findall("gazebo")
    return controller, camera


def text_of(element: ET.Element, path: str) -> str:
    """Return the text of a descendant."""
    found = element.findtext(path)
    assert found is not None, path
    return found


def test_the_cell_has_the_articles_two_plugins() -> None:
    """Controllers in the twin's namespace, and a camera that publishes as the camera node does."""
    robot = load_robot(CONFIG)
    text = robot.description.read_text(encoding="utf-8")
    controller, camera = elements(text)
    plugin = controller.find("plugin")
    assert plugin is not None and plugin.get("filename") == "libgazebo_ros_control.so"
    assert text_of(plugin, "robotNamespace") == "twin"
    assert camera.get("reference") == parse_urdf(text).root
    sensor = camera.find("sensor")
    assert sensor is not None and sensor.get("type") == "camera"
    config = load_camera(CONFIG)
    assert int(text_of(sensor, "camera/image/width")) == config.width_px
    assert float(text_of(sensor, "update_rate")) == config.frame_rate_hz
    assert text_of(sensor, "plugin/frameName") == "camera_optical_frame"
    driven = {joint.get("name") for joint in ET.fromstring(text).findall("transmission/joint")}
    assert driven == {joint.name for joint in robot.twin_joints}


URDFS = sorted((ROOT / "src" / "scara_description" / "urdf").glob("*.urdf"))


@pytest.mark.parametrize("urdf", URDFS, ids=lambda path: path.stem)
def test_each_description_stands_in_the_world(urdf: Path) -> None:
    """By one fixed joint that moves nothing; our own readers begin at the robot's base."""
    text = urdf.read_text(encoding="utf-8")
    tree, plain = ET.fromstring(text), ET.fromstring(without_world(text))
    (joint,) = [each for each in tree.findall("joint") if each.get("name") == "fixed_to_world"]
    assert joint.get("type") == "fixed" and joint.find("origin") is None
    base = parse_urdf(text).root
    assert [joint.find(end).get("link") for end in ("parent", "child")] == ["world", base]  # type: ignore[union-attr]
    names = [[each.get("name") for each in one.findall("link")] for one in (tree, plain)]
    assert names[0] == [*names[1], "world"] and len(plain) == len(tree) - 2
    (first, *others) = frames_of(text).fixed
    assert (first.parent, first.child, first.xyz) == ("world", base, (0.0, 0.0, 0.0))
    # The ghost hangs on the same base: no frame has two parents.
    ghost = frames_of(ghost_of(text))
    children = {pose.child for pose in (*ghost.fixed, *(m.home for m in ghost.moving.values()))}
    assert not children & {"world", base, *(pose.child for pose in others)}


def test_a_description_that_begins_with_a_world_of_its_own_keeps_it() -> None:
    """Of somebody else: its root is no link of ours."""
    plain = '<robot name="r">\n  <link name="world"/>\n</robot>\n'
    text = with_gazebo(plain, VIEW, "world")
    assert "fixed_to_world" not in text and parse_urdf(text).root == "world"


def test_the_camera_of_gazebo_sees_what_ours_sees() -> None:
    """The direction of view and the focal length, by the other camera's own mathematics."""
    config = load_camera(CONFIG)
    _, pitch, yaw = VIEW.rpy
    forward = (math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), -math.sin(pitch))
    wanted = np.subtract(config.look_at_m, config.position_m)
    np.testing.assert_allclose(forward, wanted / np.linalg.norm(wanted), atol=1e-12)
    focal_px = 0.5 * VIEW.width_px / math.tan(0.5 * VIEW.horizontal_fov)
    assert focal_px == pytest.approx(config.optics.intrinsics()[0, 0])


def test_writing_twice_is_writing_once() -> None:
    """An old block is replaced; the rest stays as it was."""
    once = with_gazebo(PLAIN, VIEW, "base")
    assert with_gazebo(once, VIEW, "base") == once
    other = with_gazebo(once, VIEW, "other")
    assert 'reference="other"' in other and 'reference="base"' not in other
    assert other.startswith('<robot name="r">\n  <link name="base"/>\n')


def test_a_text_that_is_no_robot_is_refused() -> None:
    """Nothing is written into it."""
    with pytest.raises(GazeboError, match="no line </robot>"):
        with_gazebo("<sdf/>", VIEW, "base")


def test_the_ghost_has_none_of_it() -> None:
    """The real robot is a picture in RViz; nothing simulates it."""
    text = load_robot(CONFIG).description.read_text(encoding="utf-8")
    assert "<gazebo" in text and "<gazebo" not in ghost_of(text)
