"""The camera's numbers are those of its pictures.

A drawn point is where the intrinsics and the pose say.
"""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml, shipped
from hypothesis import given
from hypothesis import strategies as st
from scara_config import ConfigError
from scara_simulation.camera.camera_world_io import CameraWorld, Part
from scara_simulation.camera.config import CameraConfig, load_camera
from scara_simulation.camera.optics import CameraPose, Optics
from scara_simulation.camera.round_shapes import cylinder_mesh, with_round_shapes

CONFIG = load_camera(ROOT / "config")
NUMBER = st.floats(-2.0, 2.0)
POINTS = ((0.0, 0.0, 0.0), (0.3, -0.2, 0.1), (-0.25, 0.1, -0.2))
RED = (1.0, 0.0, 0.0, 1.0)


def projected(config: CameraConfig, point: tuple[float, float, float]) -> np.ndarray:
    """Return column and row of a point by K and the frame's pose.

    As a user of CameraInfo computes them.
    """
    seen = config.pose.rotation().T @ (np.array(point) - config.pose.position)
    column, row, depth = config.optics.intrinsics() @ seen
    return np.array([column, row]) / depth


@pytest.fixture(scope="module")
def empty_cell(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a description of nothing."""
    file = tmp_path_factory.mktemp("urdf") / "nothing.urdf"
    file.write_text('<robot name="nothing"><link name="base_link"/></robot>')
    return file


@pytest.mark.parametrize("size", [(480, 360), (321, 200)])
@pytest.mark.parametrize("point", POINTS)
def test_drawn_ball_is_where_the_intrinsics_say(
    empty_cell: Path, size: tuple[int, int], point: tuple[float, float, float]
) -> None:
    """The middle of the drawn red part is the projected middle, within 0.4 pixel."""
    config = msgspec.structs.replace(CONFIG, width_px=size[0], height_px=size[1])
    with CameraWorld(empty_cell, config) as world:
        world.place_parts([Part(point, (0.0, 0.0, 0.0, 1.0), 0.02, 0.04, RED)])
        picture = world.picture().astype(int)
    rows, columns = np.nonzero(picture[:, :, 0] - picture[:, :, 2] > 60)
    assert columns.size > 20
    assert np.array([columns.mean(), rows.mean()]) == pytest.approx(
        projected(config, point), abs=0.4
    )


def test_moved_joint_moves_the_picture_and_a_part_that_goes_leaves_it_as_it_was() -> None:
    """Pictures depend on nothing but the joints and parts."""
    with CameraWorld(
        ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf", CONFIG
    ) as world:
        before = world.picture()
        world.place({"joint_1": 0.4, "unknown": 1.0})
        world.place_parts([Part((0.3, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0), 0.02, 0.02, RED)])
        moved = world.picture()
        world.place({"joint_1": 0.0})
        world.place_parts([])
        again = world.picture()
        assert world.root == "base_link"
    assert before.shape == (CONFIG.height_px, CONFIG.width_px, 3)
    assert np.count_nonzero((before != moved).any(axis=2)) > 500
    assert np.array_equal(before, again)


@given(position=st.tuples(NUMBER, NUMBER, NUMBER), look_at=st.tuples(NUMBER, NUMBER, NUMBER))
def test_optical_frame_looks_along_z_with_y_down(
    position: tuple[float, float, float], look_at: tuple[float, float, float]
) -> None:
    """REP-103; the quaternion is the same rotation, of length one."""
    pose = CameraPose(position, look_at)
    rotation_is_defined = np.linalg.norm(np.cross(np.subtract(look_at, position), pose.up)) > 1e-3
    if not rotation_is_defined:
        return
    r = pose.rotation()
    assert r.T @ r == pytest.approx(np.eye(3), abs=1e-9) and np.linalg.det(r) == pytest.approx(1.0)
    distance = float(np.linalg.norm(np.subtract(look_at, position)))
    assert r.T @ np.subtract(look_at, position) == pytest.approx(
        np.array([0.0, 0.0, distance]), abs=1e-9
    )
    assert r[2, 1] <= 1e-9
    x, y, z, w = pose.quaternion()
    v = np.array([x, y, z])
    for axis in np.eye(3):
        turned = axis + 2.0 * w * np.cross(v, axis) + 2.0 * np.cross(v, np.cross(v, axis))
        assert turned == pytest.approx(r @ axis, abs=1e-9)


def test_field_of_view_is_that_of_the_whole_picture() -> None:
    """From the upper edge of the first row to the lower edge of the last."""
    optics = Optics(640, 480, math.radians(50.0), 0.1, 5.0)
    k = optics.intrinsics()
    upper, lower = ((row - k[1, 2]) / k[1, 1] for row in (-0.5, 479.5))
    assert math.atan(lower) - math.atan(upper) == pytest.approx(math.radians(50.0))


def test_mesh_of_a_cylinder_is_closed_and_of_unit_size() -> None:
    """Each edge belongs to two faces, in both directions."""
    lines = [line.split() for line in cylinder_mesh(12).splitlines()]
    points = np.array([[float(word) for word in line[1:]] for line in lines if line[0] == "v"])
    assert np.hypot(points[:, 0], points[:, 1]) == pytest.approx(np.ones(24))
    assert set(points[:, 2]) == {-0.5, 0.5}
    faces = [[int(word.split("/")[0]) for word in line[1:]] for line in lines if line[0] == "f"]
    edges = {(face[k], face[(k + 1) % 3]) for face in faces for k in range(3)}
    assert len(edges) == 3 * len(faces) and {(b, a) for a, b in edges} == edges


def test_cylinders_become_meshes_of_the_same_size_and_nothing_collides() -> None:
    """Boxes stay what they are."""
    text = with_round_shapes(
        '<robot name="r"><link name="a"><visual><geometry><cylinder radius="0.1" '
        'length="0.4"/></geometry></visual>'
        '<visual><geometry><box size="1 1 1"/></geometry></visual>'
        '<collision><geometry><box size="1 1 1"/></geometry></collision></link></robot>'
    )
    assert 'scale="0.1 0.1 0.4"' in text and text.count("<box") == 1 and "collision" not in text


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("near_m", 10.0, r"camera\.yaml: near_m = 10: must be below far_m = 10"),
        (
            "look_at_m",
            [1.08, -1.08, -3.0],
            r"look_at_m = .*this must be a direction, and not that of up",
        ),
        ("width_px", 0, r"width_px = 0"),
    ],
)
def test_camera_that_sees_nothing_is_refused(
    tmp_path: Path, key: str, value: object, text: str
) -> None:
    """File, key, value and what is allowed."""
    folder = changed_yaml(shipped("camera.yaml"), tmp_path, [key], value)
    with pytest.raises(ConfigError, match=text):
        load_camera(folder)


def test_parameters_stand_above_the_file_and_are_checked_too() -> None:
    """As rosrun gives them."""
    assert load_camera(ROOT / "config", {"width_px": 64, "frame_rate_hz": 2}).width_px == 64
    with pytest.raises(ConfigError, match=r"parameters over camera\.yaml: frame_rate_hz = 0"):
        load_camera(ROOT / "config", {"frame_rate_hz": 0})
    with pytest.raises(ConfigError, match="~colour: no such parameter; there are width_px"):
        load_camera(ROOT / "config", {"colour": 1})
