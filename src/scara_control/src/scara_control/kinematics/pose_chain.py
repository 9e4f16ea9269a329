r"""Forward kinematics of one joint vector in plain numbers.

It is the same product of exponentials, carried as a point and a quaternion.

A screw of unit length turns the point p about the axis :math:`\omega` through :math:`c = \omega
\times v` and moves it along,

.. math:: p' = c + R(\omega, q)\,(p - c) + \omega\,(\omega \cdot v)\,q,

or, without a turning part, only moves it by :math:`v q`. For one pose this takes a tenth of the
time that arrays take; :func:`scara_control.kinematics.screws.forward_kinematics` is its check.

Source: Lynch & Park, Modern Robotics (2017), sec. 3.3 and 4.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from scara_control.kinematics.screws import ScrewModel
from scara_control.kinematics.twists import quaternion

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_NO_SIGN = 1e-9
"""A part of a quaternion so small does not decide its sign, as in
:func:`scara_control.kinematics.twists.quaternion`."""


class PoseChain:
    """An open chain, ready to be asked for poses one at a time."""

    def __init__(self, arm: ScrewModel) -> None:
        """Work out for each joint, tool to base.

        That is its turning axis, a point on it, and its translation per unit of motion.
        """
        self._joints: list[tuple[Vector, Vector, Vector]] = []
        for screw in arm.screw_axes.T[::-1]:
            omega, v = screw[:3], screw[3:]
            point, along = (np.cross(omega, v), omega * (omega @ v)) if omega.any() else (omega, v)
            self._joints.append((_triple(omega), _triple(point), _triple(along)))
        self._home = _triple(arm.home_pose[:3, 3])
        self._home_orientation = quaternion(arm.home_pose[:3, :3])

    def pose(self, q: Sequence[float]) -> tuple[Vector, Quaternion]:
        """Compute position [m] and orientation ``(x, y, z, w)`` of the tool; nothing is checked.

        Args:
            q: Joint positions, base to tool, shape ``(n,)``: [rad], prismatic [m].

        Returns:
            Both in the base frame; the quaternion's first non-zero of (w, x, y, z) is positive.
        """
        (px, py, pz), (x, y, z, w) = self._home, self._home_orientation
        for ((a, b, g), (cx, cy, cz), (vx, vy, vz)), value in zip(self._joints, reversed(q)):
            if a or b:
                c, s = cos(0.5 * value), sin(0.5 * value)
                a, b, g = a * s, b * s, g * s
                dx, dy, dz = px - cx, py - cy, pz - cz
                tx, ty, tz = (
                    2.0 * (b * dz - g * dy),
                    2.0 * (g * dx - a * dz),
                    2.0 * (a * dy - b * dx),
                )
                px, py, pz = (
                    px + c * tx + b * tz - g * ty,
                    py + c * ty + g * tx - a * tz,
                    pz + c * tz + a * ty - b * tx,
                )
                x, y, z, w = (
                    c * x + w * a + b * z - g * y,
                    c * y + w * b + g * x - a * z,
                    c * z + w * g + a * y - b * x,
                    c * w - a * x - b * y - g * z,
                )
            elif g:  # about z, as every turning axis of a SCARA
                c, s = cos(0.5 * value), g * sin(0.5 * value)
                cosine, sine, dx, dy = 1.0 - 2.0 * s * s, 2.0 * s * c, px - cx, py - cy
                px, py = cx + cosine * dx - sine * dy, cy + sine * dx + cosine * dy
                x, y, z, w = c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z
            px, py, pz = px + vx * value, py + vy * value, pz + vz * value
        if w > _NO_SIGN or (
            w > -_NO_SIGN and next((part for part in (x, y, z) if abs(part) > _NO_SIGN), 1.0) > 0.0
        ):
            return (px, py, pz), (x, y, z, w)
        return (px, py, pz), (-x, -y, -z, -w)


def _triple(values: np.ndarray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
