"""Read the triangles of a mesh: STL, binary or as text, and OBJ.

Source: the formats as their authors describe them: 80 bytes, a count and 50 bytes a triangle;
``vertex x y z`` three times in a loop; ``v`` and ``f`` lines.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scara_description.cover import FloatArray
from scara_description.urdf import UrdfError

HEAD, TRIANGLE = 84, 50
"""Bytes of a binary STL before its triangles, and of each."""
ENDINGS = (".stl", ".obj")


def read_mesh(path: Path) -> FloatArray:
    """Return a mesh's triangles, shape (n, 3, 3), in the file's own unit.

    Raises:
        UrdfError: It cannot be read, is of another kind, or has no triangle.
    """
    try:
        if path.suffix.lower() == ".obj":
            found = _obj(path.read_text(encoding="utf-8", errors="replace"))
        elif path.suffix.lower() == ".stl":
            found = _stl(path.read_bytes())
        else:
            kinds = " or ".join(ENDINGS)
            how = "export it as one of these, with MeshLab or Blender, and name that"
            raise UrdfError(f"{path}: a mesh of kind {path.suffix}: Expected {kinds}: {how}")
    except OSError as error:
        raise UrdfError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, IndexError) as error:
        if isinstance(error, UrdfError):
            raise
        raise UrdfError(f"{path}: is no mesh: {error}") from error
    if len(found) == 0 or not np.isfinite(found).all():
        raise UrdfError(f"{path}: {len(found)} triangles: Expected some, of finite numbers")
    return found


def find_mesh(name: str, urdf: Path) -> Path:
    """Return where a mesh is that a URDF names: ``package://``, ``file://`` or beside the URDF.

    A package is looked for in the folders above the URDF, under its name or without it.

    Raises:
        UrdfError: It is not there.
    """
    scheme, _, rest = name.rpartition("://")
    ways = [rest, rest.partition("/")[2]] if scheme in ("package", "model") else [rest]
    above = [Path("/")] if scheme == "file" else urdf.resolve().parents
    for folder in above:
        for way in ways:
            if way and (folder / way).is_file():
                return folder / way
    raise UrdfError(f"mesh {name}: is missing: looked for {ways[0]} in all folders above {urdf}")


def _stl(data: bytes) -> FloatArray:
    """Return the triangles of an STL; one whose size fits its count is binary."""
    count = int.from_bytes(data[80:HEAD], "little")
    # Not by its first word: a binary file may begin with "solid" as well as a text.
    if len(data) >= HEAD and len(data) == HEAD + TRIANGLE * count:
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        return np.frombuffer(data, kind, offset=HEAD)["corners"].astype(float)
    # A text's name may be of any letters; only lines of a vertex count.
    words = [line.split() for line in data.decode("ascii", errors="replace").splitlines()]
    rows = [[float(x) for x in word[1:4]] for word in words if word[:1] == ["vertex"]]
    return np.array(rows, dtype=float).reshape(-1, 3, 3)


def _obj(text: str) -> FloatArray:
    """Return the triangles of an OBJ; a face of more corners is a fan."""
    corners: list[list[float]] = []
    found: list[list[list[float]]] = []
    for line in text.splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            corners.append([float(x) for x in words[:3]])
        elif key == "f":
            numbers = [int(word.partition("/")[0]) for word in words]
            # Counted from 1; from the end where negative.
            face = [corners[k - 1 if k > 0 else k] for k in numbers]
            found += [[face[0], *face[k : k + 2]] for k in range(1, len(face) - 1)]
    return np.array(found, dtype=float).reshape(-1, 3, 3)
