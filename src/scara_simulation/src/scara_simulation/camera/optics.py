"""Projection of a camera without distortion, and the pose of its optical frame.

Z forward, x right, y down; REP-103.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

Vector = tuple[float, float, float]
SMALLEST = 1e-6


@dataclass(frozen=True)
class Optics:
    """A pinhole camera.

    Attributes:
        width: Columns of the picture.
        height: Rows.
        field_of_view: Between the upper edge of the first row and the lower edge of the last [rad].
        near: What is nearer is not seen [m].
        far: What is farther is not seen [m].
    """

    width: int
    height: int
    field_of_view: float
    near: float
    far: float

    @property
    def focal_length(self) -> float:
        """Focal length [pixel], the same in both directions."""
        return self.height / (2.0 * math.tan(self.field_of_view / 2.0))

    def intrinsics(self) -> np.ndarray:
        """Return the matrix K of sensor_msgs/CameraInfo, shape (3, 3).

        The middle of the first pixel is (0, 0).
        """
        f = self.focal_length
        return np.array(
            [[f, 0.0, (self.width - 1) / 2.0], [0.0, f, (self.height - 1) / 2.0], [0.0, 0.0, 1.0]]
        )

    def projection(self) -> np.ndarray:
        """Return OpenGL's projection matrix, shape (4, 4)."""
        matrix = np.zeros((4, 4))
        depth = self.near - self.far
        matrix[0, 0] = 2.0 * self.focal_length / self.width
        matrix[1, 1] = 2.0 * self.focal_length / self.height
        matrix[2, 2:] = (self.far + self.near) / depth, 2.0 * self.far * self.near / depth
        matrix[3, 2] = -1.0
        return matrix


@dataclass(frozen=True)
class CameraPose:
    """Where a camera stands, which point it looks at [m], and what shall be up in its picture."""

    position: Vector
    look_at: Vector
    up: Vector = (0.0, 0.0, 1.0)

    @property
    def is_defined(self) -> bool:
        """Whether there is a direction of view, and up is another one."""
        forward = np.subtract(self.look_at, self.position)
        return bool(np.linalg.norm(np.cross(forward, self.up)) > SMALLEST)

    def rotation(self) -> np.ndarray:
        """Return the orientation of the optical frame in the base frame, shape (3, 3)."""
        forward = np.subtract(self.look_at, self.position)
        right = np.cross(forward, self.up)
        z, x = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
        return np.column_stack([x, np.cross(z, x), z])

    def quaternion(self) -> tuple[float, float, float, float]:
        """Return the orientation as x, y, z, w.

        Shepperd's method, so that no case divides by a small number.
        """
        r = self.rotation()
        trace = float(np.trace(r))
        sizes = [float(r[0, 0]), float(r[1, 1]), float(r[2, 2]), trace]
        k = int(np.argmax(sizes))
        q = np.empty(4)
        if k == 3:
            q[:] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + trace
        else:
            i, j = (k + 1) % 3, (k + 2) % 3
            q[k], q[i] = 1.0 + 2.0 * sizes[k] - trace, r[i, k] + r[k, i]
            q[j], q[3] = r[j, k] + r[k, j], r[j, i] - r[i, j]
        x, y, z, w = (float(value) for value in q / np.linalg.norm(q))
        return x, y, z, w

    def view(self) -> np.ndarray:
        """Return OpenGL's view matrix, shape (4, 4): its camera looks along -z, with y up."""
        matrix = np.eye(4)
        matrix[:3, :3] = np.diag([1.0, -1.0, -1.0]) @ self.rotation().T
        matrix[:3, 3] = -matrix[:3, :3] @ np.array(self.position)
        return matrix
