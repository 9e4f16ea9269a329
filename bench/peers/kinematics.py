"""Inverse kinematics by KDL, modern_robotics and the Robotics Toolbox.

One SCARA of three joints, given as its lengths.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle
from typing import Any

from bench.timing import timed_blocks


class _Solver:
    """Solves targets in turn; ``solve`` is set by the library's class."""

    solve: Callable[[Any], object]
    tasks: list[Any]
    block = 100

    def _take(self) -> int:
        solve, tasks = self.solve, self._turn
        for _ in range(self.block):
            solve(next(tasks))
        return self.block

    def round(self, blocks: int) -> list[float]:
        """Return the seconds of one solution, for each block of solutions."""
        self._turn = getattr(self, "_turn", None) or cycle(self.tasks)
        return timed_blocks(blocks, self._take)


class Kdl(_Solver):
    """KDL's Levenberg-Marquardt solver in C++, by Debian's PyKDL."""

    def __init__(
        self, lengths: list[float], targets: list[list[float]], seeds: list[list[float]]
    ) -> None:
        """Take L1, L2, h [m], joint positions (their poses are the targets) and first guesses."""
        import PyKDL as Kdl_

        self.kdl = Kdl_
        l1, l2, h = lengths
        chain = Kdl_.Chain()
        for kind, tip in (
            ("RotZ", (l1, 0.0, 0.0)),
            ("RotZ", (l2, 0.0, 0.0)),
            ("TransZ", (0.0, 0.0, h)),
        ):
            chain.addSegment(
                Kdl_.Segment(Kdl_.Joint(getattr(Kdl_.Joint, kind)), Kdl_.Frame(Kdl_.Vector(*tip)))
            )
        self.chain, self.solver = chain, Kdl_.ChainIkSolverPos_LMA(chain)
        self.forward = Kdl_.ChainFkSolverPos_recursive(chain)
        answer = self.vector([0.0, 0.0, 0.0])
        self.tasks = [
            (self.vector(seed), self.frame(target)) for seed, target in zip(seeds, targets)
        ]
        self.solve = lambda task: self.solver.CartToJnt(task[0], task[1], answer)
        self.version = f"KDL {getattr(Kdl_, '__version__', '1.5.1')}"

    def vector(self, values: list[float]) -> Any:
        """Return a joint array."""
        vector = self.kdl.JntArray(len(values))
        for index, value in enumerate(values):
            vector[index] = value
        return vector

    def frame(self, q: list[float]) -> Any:
        """Return the tool's frame."""
        frame = self.kdl.Frame()
        self.forward.JntToCart(self.vector(q), frame)
        return frame

    def errors(self) -> list[float]:
        """Return how far each solution is from its target [m].

        A solver that gave up counts as 1 m.
        """
        found, errors = self.vector([0.0, 0.0, 0.0]), []
        for seed, target in self.tasks:
            code = self.solver.CartToJnt(seed, target, found)
            reached = self.kdl.Frame()
            self.forward.JntToCart(found, reached)
            errors.append((reached.p - target.p).Norm() if code == 0 else 1.0)
        return errors


class ModernRobotics(_Solver):
    """modern_robotics.IKinSpace: Newton's method in numpy, as in the book."""

    block = 5

    def __init__(
        self,
        screws: list[list[float]],
        home: list[list[float]],
        targets: list[list[float]],
        seeds: list[list[float]],
    ) -> None:
        """Take screw axes (6, n), home pose, joint positions of the targets, first guesses."""
        import modern_robotics as mr
        import numpy as np

        axes, pose = np.array(screws), np.array(home)
        self.tasks = [
            (mr.FKinSpace(pose, axes, np.array(target)), np.array(seed))
            for target, seed in zip(targets, seeds)
        ]
        self.solve = lambda task: mr.IKinSpace(axes, pose, task[0], task[1], 1e-5, 1e-5)
        self.version = f"modern_robotics {mr.__version__}"


class Toolbox(_Solver):
    """Robotics Toolbox's Levenberg-Marquardt solver in C++."""

    block = 50

    def __init__(
        self, lengths: list[float], targets: list[list[float]], seeds: list[list[float]]
    ) -> None:
        """Take L1, L2, h [m], joint positions of the targets, first guesses."""
        import numpy as np
        from roboticstoolbox import ET, ETS

        l1, l2, h = lengths
        arm = ETS([ET.Rz(), ET.tx(l1), ET.Rz(), ET.tx(l2), ET.tz(), ET.tz(h)])
        mask = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        self.tasks = [
            (arm.fkine(np.array(target)).A, np.array(seed)) for target, seed in zip(targets, seeds)
        ]
        self.solve = lambda task: arm.ik_LM(task[0], q0=task[1], mask=mask, joint_limits=False)
        self.version = "Robotics Toolbox"
