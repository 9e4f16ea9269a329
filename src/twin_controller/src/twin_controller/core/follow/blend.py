r"""Close a gap slowly: an offset that decays to zero with continuous velocity and acceleration.

.. math:: d(t) = d_0 \left(1 - 10 u^3 + 15 u^4 - 6 u^5\right), \quad u = (t - t_0) / T

The largest speed is :math:`1.875\, d_0 / T`, so T follows from the speed that is allowed.
"""

from __future__ import annotations

import msgspec

from twin_controller.core.events import Joints

PEAK = 1.875
SHORTEST_S = 1e-6


class Blend(msgspec.Struct, frozen=True):
    """An offset on the way to zero: ``offset`` at ``start`` [s], zero after ``duration`` [s]."""

    offset: Joints
    start: float
    duration: float


def begin_blend(offset: Joints, start: float, speeds: Joints) -> Blend:
    """Plan the decay of ``offset`` so that no joint exceeds its entry of ``speeds``.

    Args:
        offset: Offset of each joint at ``start``, SI.
        start: Begin [s].
        speeds: Largest speed of each joint, SI, positive.
    """
    duration = max((PEAK * abs(gap) / speed for gap, speed in zip(offset, speeds)), default=0.0)
    return Blend(offset, start, duration if duration > SHORTEST_S else 0.0)


def sample_blend(blend: Blend, t: float) -> tuple[Joints, Joints, Joints]:
    """Return offset, its velocity and its acceleration at ``t`` [s]."""
    zero = (0.0,) * len(blend.offset)
    if blend.duration <= 0.0 or t >= blend.start + blend.duration:
        return zero, zero, zero
    u = max(0.0, (t - blend.start) / blend.duration)
    left = 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    rate = -30.0 * u * u * (1.0 - u) ** 2 / blend.duration
    curve = -60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / blend.duration**2
    return (
        tuple(gap * left for gap in blend.offset),
        tuple(gap * rate for gap in blend.offset),
        tuple(gap * curve for gap in blend.offset),
    )


def finished(blend: Blend, t: float) -> bool:
    """Return whether the offset is zero at ``t`` [s]."""
    return t >= blend.start + blend.duration
