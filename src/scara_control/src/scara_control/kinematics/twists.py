"""Rigid motions of space: twists (omega first), adjoint, matrix exponential.

Source: Lynch & Park, Modern Robotics (2017), chapter 3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SERIES_BELOW = 1e-4
"""[rad] Below this angle the exponential's coefficients are taken from their series (error <
angle^4 / 2520 ~ 4e-20)."""


def skew(vector: FloatArray) -> FloatArray:
    """Return the matrix of the cross product, ``skew(a) @ b == cross(a, b)``, shape ``(3, 3)``."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def twist_matrix(twist: FloatArray) -> FloatArray:
    """Return the 4 x 4 matrix form of a twist ``(omega, v)``."""
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = skew(twist[:3])
    matrix[:3, 3] = twist[3:]
    return matrix


def exp6(twist: FloatArray) -> FloatArray:
    r"""Compute the motion that a constant twist makes in one unit of time.

    .. math:: e^{[V]} = I + [V] + \frac{1-\cos\theta}{\theta^2}[V]^2
        + \frac{\theta-\sin\theta}{\theta^3}[V]^3,
              \quad \theta = |\omega|

    One formula for turning, sliding and screwing: with omega = 0 the square of the matrix is zero.
    In plain numbers, which take a quarter of the time of arrays of this size; of the rotation
    :math:`[V]^3 = -\theta^2 [V]`.

    Args:
        twist: ``(omega, v)`` times time, shape ``(6,)``: [rad], [m].

    Returns:
        Homogeneous transform, shape ``(4, 4)``.
    """
    a, b, c, u, v, w = twist.tolist()
    angle = math.sqrt(a * a + b * b + c * c)
    if angle < _SERIES_BELOW:
        second, third = 0.5 - angle**2 / 24.0, 1.0 / 6.0 - angle**2 / 120.0
    else:
        # 1 - cos without cancellation.
        second, third = (
            2.0 * (math.sin(angle / 2.0) / angle) ** 2,
            (angle - math.sin(angle)) / angle**3,
        )
    first = 1.0 - third * angle * angle
    x, y, z = b * w - c * v, c * u - a * w, a * v - b * u
    return np.array(
        (
            (
                1.0 - second * (b * b + c * c),
                second * a * b - first * c,
                second * a * c + first * b,
                u + second * x + third * (b * z - c * y),
            ),
            (
                second * a * b + first * c,
                1.0 - second * (a * a + c * c),
                second * b * c - first * a,
                v + second * y + third * (c * x - a * z),
            ),
            (
                second * a * c - first * b,
                second * b * c + first * a,
                1.0 - second * (a * a + b * b),
                w + second * z + third * (a * y - b * x),
            ),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def adjoint(transform: FloatArray) -> FloatArray:
    """Return the 6 x 6 matrix that expresses a twist given in the moved frame in the fixed one."""
    rotation = transform[:3, :3]
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = rotation
    matrix[3:, 3:] = rotation
    matrix[3:, :3] = skew(transform[:3, 3]) @ rotation
    return matrix


def quaternion(rotation: FloatArray) -> tuple[float, float, float, float]:
    """Return the unit quaternion ``(x, y, z, w)`` of a rotation matrix.

    The first non-zero one of (w, x, y, z) is positive.

    The column of the largest diagonal term of the quaternion's outer product is taken, so nothing
    small is divided by.

    Args:
        rotation: Proper rotation, shape ``(3, 3)``.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    outer = (
        (1.0 + xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, 1.0 + xx - yy - zz, xy + yx, xz + zx),
        (xz - zx, xy + yx, 1.0 - xx + yy - zz, yz + zy),
        (yx - xy, xz + zx, yz + zy, 1.0 - xx - yy + zz),
    )
    largest = max(range(4), key=lambda index: outer[index][index])
    norm = math.copysign(
        math.hypot(*outer[largest]), next((v for v in outer[largest] if abs(v) > 1e-9), 1.0)
    )
    w, x, y, z = (value / norm for value in outer[largest])
    return x, y, z, w
