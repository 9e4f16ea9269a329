"""Triangles of meshes, as other programs write them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scara_description.cover import cover
from scara_description.mesh_io import find_mesh, read_mesh

from scara_description.urdf import UrdfError

CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]]


def test_all_kinds_have_the_same_triangles(tmp_path: Path) -> None:
    """A binary STL that begins with the word solid, as some do; one as text; a face of four."""
    two = np.array([[CORNERS[0], *CORNERS[k : k + 2]] for k in (1, 2)])
    binary, text, faces = (tmp_path / name for name in ("a.STL", "b.stl", "c.obj"))
    rows = b"".join(struct.pack("<12fH", 0, 0, 1, *each.ravel(), 0) for each in two)
    binary.write_bytes(b"solid".ljust(80) + struct.pack("<I", 2) + rows)
    loops = [f"  vertex {x} {y} {z}" for x, y, z in two.reshape(-1, 3)]
    text.write_text("\n".join(["solid", *loops, "endsolid"]))
    vertices = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    faces.write_text("\n".join(["# ours", *vertices, "vn 0 0 1", "f 1/1/1 2//1 -2 4"]))
    for path in (binary, text, faces):
        np.testing.assert_array_equal(read_mesh(path), two)


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("a.dae", b"<COLLADA/>", r"a.dae: a mesh of kind .dae: Expected .stl or .obj"),
        ("a.stl", b"solid\nendsolid", "0 triangles: Expected some"),
        ("a.stl", b"vertex 1 2", "is no mesh"),
        ("a.stl", b"vertex nan 0 0\n" * 3, "1 triangles: Expected some, of finite numbers"),
        ("a.obj", b"f 1 2 3", "is no mesh"),
    ],
)
def test_what_is_no_mesh_is_refused(tmp_path: Path, name: str, data: bytes, told: str) -> None:
    """The text names the file."""
    (tmp_path / name).write_bytes(data)
    with pytest.raises(UrdfError, match=told):
        read_mesh(tmp_path / name)


def test_a_mesh_is_found_by_its_package_or_without_it(tmp_path: Path) -> None:
    """A package whose folder has another name, as of a clone; or beside the URDF."""
    urdf = tmp_path / "clone" / "urdf" / "arm.urdf"
    mesh = tmp_path / "clone" / "meshes" / "a.stl"
    urdf.parent.mkdir(parents=True)
    mesh.parent.mkdir()
    mesh.write_text("")
    for name in ("package://arm/meshes/a.stl", "package://clone/meshes/a.stl", f"file://{mesh}"):
        assert find_mesh(name, urdf) == mesh
    assert find_mesh("../meshes/a.stl", urdf).samefile(mesh)
    with pytest.raises(UrdfError, match=r"mesh package://arm/b.stl: is missing"):
        find_mesh("package://arm/b.stl", urdf)


def test_a_plate_and_a_rod_are_covered_closely() -> None:
    """A plate has a thickness; a round rod gets a cylinder, a long one several shapes."""
    turns = np.linspace(0.0, 2.0 * np.pi, 40)
    ring = np.array([np.cos(turns), np.sin(turns), np.zeros(40)]).T * 0.03
    low, high = ring, ring + [0.0, 0.0, 0.4]
    sides = [(low[:-1], low[1:], high[1:]), (low[:-1], high[1:], high[:-1])]
    rod = np.concatenate([np.stack(side, axis=1) for side in sides])
    shapes = cover(rod)
    assert {shape.kind for shape in shapes} == {"cylinder"} and len(shapes) > 1
    assert sum(s.size[1] for s in shapes) == pytest.approx(0.4)
    assert all(s.size[0] == pytest.approx(0.03, abs=1e-4) for s in shapes)
    (plate,) = cover(
        np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]])
    )
    assert sorted(plate.size) == pytest.approx([0.001, 1.0, 1.0])
