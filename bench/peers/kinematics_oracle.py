"""Poses and Jacobians by other libraries, to be compared with ours."""

from __future__ import annotations

from typing import Any


class KdlPoses:
    """KDL on the closed-form SCARA: positions and Jacobians."""

    def __init__(self, lengths: list[float]) -> None:
        """Take L1, L2, h [m]."""
        from bench.peers.kinematics import Kdl

        self._arm = Kdl(lengths, [], [])
        self._solver = self._arm.kdl.ChainJntToJacSolver(self._arm.chain)
        self.version = self._arm.version

    def kinematics(self, poses: list[list[float]]) -> list[list[Any]]:
        """Return position (3,) and Jacobian (6, 3; omega first, base axes) for each q."""
        found = []
        jacobian = self._arm.kdl.Jacobian(3)
        for q in poses:
            position = self._arm.frame(q).p
            self._solver.JntToJac(self._arm.vector(q), jacobian)
            rows = [[jacobian[row, column] for column in range(3)] for row in (3, 4, 5, 0, 1, 2)]
            found.append([[position[axis] for axis in range(3)], rows])
        return found


class BookPoses:
    """modern_robotics on the screws of robot.yaml: poses and Jacobians of the spatial twist."""

    def __init__(self, screws: list[list[float]], home: list[list[float]]) -> None:
        """Take screw axes (6, n) and home pose."""
        import modern_robotics as mr
        import numpy as np

        self._mr, self._np = mr, np
        self._axes, self._home = np.array(screws), np.array(home)
        self.version = f"modern_robotics {mr.__version__}"

    def kinematics(self, poses: list[list[float]]) -> list[list[Any]]:
        """Return pose (4, 4) and space Jacobian (6, n) for each q."""
        mr, array = self._mr, self._np.array
        return [
            [
                mr.FKinSpace(self._home, self._axes, array(q)).tolist(),
                mr.JacobianSpace(self._axes, array(q)).tolist(),
            ]
            for q in poses
        ]
