"""Forward kinematics by a library that we did not write: KDL, on a chain of screw axes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import PyKDL
from scara_config import Joint
from scara_config.frames import TaughtFrame


class KdlChain:
    """The same arm by its screws in another library."""

    def __init__(self, joints: Sequence[Joint], home_pose: Sequence[Sequence[float]]) -> None:
        """Turn each joint about the point of its axis, and put the home pose behind all."""
        self._chain = PyKDL.Chain()
        for joint in joints:
            assert joint.screw_axis is not None
            omega, v = np.array(joint.screw_axis[:3]), np.array(joint.screw_axis[3:])
            kind = PyKDL.Joint.RotAxis if omega.any() else PyKDL.Joint.TransAxis
            place, axis = (np.cross(omega, v), omega) if omega.any() else (omega, v)
            vectors = (PyKDL.Vector(*place.tolist()), PyKDL.Vector(*axis.tolist()))
            self._chain.addSegment(
                PyKDL.Segment(PyKDL.Joint(joint.name, *vectors, kind), PyKDL.Frame())
            )
        rows = np.array(home_pose)
        rotation = PyKDL.Rotation(*rows[:3, :3].ravel().tolist())
        tip = PyKDL.Frame(rotation, PyKDL.Vector(*rows[:3, 3].tolist()))
        self._chain.addSegment(PyKDL.Segment(PyKDL.Joint(PyKDL.Joint.Fixed), tip))
        self._solver, self._frame = PyKDL.ChainFkSolverPos_recursive(self._chain), PyKDL.Frame()

    def pose(self, q: Sequence[float]) -> np.ndarray:
        """Return the tool's pose, shape (3, 4)."""
        values = PyKDL.JntArray(len(q))
        for k, value in enumerate(q):
            values[k] = value
        assert self._solver.JntToCart(values, self._frame) == 0
        return np.array([[self._frame[row, column] for column in range(4)] for row in range(3)])


def kdl_pose(frame: TaughtFrame) -> np.ndarray:
    """Return a frame's pose by this library, shape (4, 4) [m]."""
    w, p, r = map(math.radians, frame.wpr_deg)
    made = PyKDL.Frame(PyKDL.Rotation.RPY(w, p, r), PyKDL.Vector(*[1e-3 * x for x in frame.xyz_mm]))
    return np.array(
        [[made[row, column] for column in range(4)] for row in range(3)] + [[0, 0, 0, 1]]
    )
