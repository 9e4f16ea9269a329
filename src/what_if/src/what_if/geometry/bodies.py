"""The bodies of the cell: convex shapes that hang on links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from scara_description.urdf import Model, origin_transform

FloatArray = npt.NDArray[np.float64]


class Kind(Enum):
    """What a body is, for who may touch whom."""

    ARM = "arm"
    NOZZLE = "nozzle"
    HELD = "held part"
    PART = "part"
    REST = "rest"
    """Where parts may lie: a stand or the pallet."""
    CELL = "cell"
    OBSTACLE = "obstacle"
    PERSON = "person"
    ZONE = "zone"


MOVED_BY_ARM = (Kind.ARM, Kind.NOZZLE, Kind.HELD)


@dataclass(frozen=True)
class Body:
    """One convex shape on a link.

    Attributes:
        name: For people: the link, the part, the obstacle.
        kind: What it is.
        link: The link that carries it.
        shape: box, cylinder (along its z) or sphere.
        size: box: lengths in x, y, z; cylinder: radius, length; sphere: radius [m].
        pose: In the link's frame, shape (4, 4), translation in [m].
    """

    name: str
    kind: Kind
    link: str
    shape: str
    size: tuple[float, ...]
    pose: FloatArray

    @property
    def half(self) -> FloatArray:
        """Half lengths of the box around it, in its own frame [m], shape (3,)."""
        if self.shape == "box":
            return 0.5 * np.array(self.size)
        if self.shape == "cylinder":
            radius, length = self.size
            return np.array((radius, radius, 0.5 * length))
        return np.full(3, self.size[0])

    @property
    def corners(self) -> FloatArray:
        """Corners of a box around it in the link's frame [m], shape (8, 3)."""
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
        return signs * self.half @ self.pose[:3, :3].T + self.pose[:3, 3]


def bodies_of(model: Model, tool_frame: str, rests: Sequence[str]) -> tuple[Body, ...]:
    """Return a robot description's shapes as bodies.

    Args:
        model: The description with its collision shapes.
        tool_frame: The link at the end of the arm; what a joint on its chain carries is the arm.
        rests: Names of the links on which parts may lie.
    """
    moved_by = {joint.name for joint in model.chain(tool_frame) if joint.moves}
    # All that a joint of the arm carries, also beside the way to the tool: a camera, a hose. What
    # hangs before the first moving joint stands still and belongs to the cell.
    arm = {link for link in model.shapes if any(j.name in moved_by for j in model.chain(link))}

    def kind(link: str) -> Kind:
        # Asked before the arm: the tool's link is at the end of the same chain.
        if link == tool_frame:
            return Kind.NOZZLE
        if link in arm:
            return Kind.ARM
        return Kind.REST if link in rests else Kind.CELL

    return tuple(
        Body(link, kind(link), link, shape.kind, shape.size, origin_transform(shape.xyz, shape.rpy))
        for link, shapes in model.shapes.items()
        for shape in shapes
    )


def upright(
    name: str, kind: Kind, link: str, shape: str, size: Sequence[float], middle: Sequence[float]
) -> Body:
    """Return a body that stands upright in its link's frame, its middle at ``middle`` [m]."""
    pose = np.eye(4)
    pose[:3, 3] = middle
    return Body(name, kind, link, shape, tuple(size), pose)


def box_between(name: str, kind: Kind, link: str, low: FloatArray, high: FloatArray) -> Body:
    """Return the box between two corners [m] of a link's frame."""
    return upright(name, kind, link, "box", (high - low).tolist(), (0.5 * (low + high)).tolist())


def half_extents(body: Body, rotations: FloatArray) -> FloatArray:
    r"""Return the half lengths of the smallest upright box around a body in some poses.

    Of a box :math:`|R| h`, of a cylinder :math:`\tfrac{l}{2} |R_{i3}| + r \sqrt{1 - R_{i3}^2}`.

    Args:
        body: The body.
        rotations: Of the body's own frame in the world, shape (n, 3, 3).

    Returns:
        Half lengths along x, y, z of the world [m], shape (n, 3).
    """
    if body.shape == "box":
        found: FloatArray = np.abs(rotations) @ body.half
        return found
    if body.shape == "cylinder":
        radius, length = body.size
        along = np.abs(rotations[:, :, 2])
        # Rounding makes an entry of a rotation a little more than 1; its root would be no number.
        return 0.5 * length * along + radius * np.sqrt(np.maximum(0.0, 1.0 - along * along))
    return np.full((len(rotations), 3), body.size[0])
