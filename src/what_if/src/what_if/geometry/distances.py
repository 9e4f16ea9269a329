"""Distances of two bodies by Coal, the collision library that pinocchio uses.

Its distance of boxes, cylinders and spheres is exact but for the tolerance of its iteration
(decision 0029 compares libraries).
"""

from __future__ import annotations

from collections.abc import Sequence

try:
    import coal
except ModuleNotFoundError as error:
    raise ImportError(
        "what_if needs the library coal, which `./cell setup run` installs"
    ) from error
import numpy as np

from what_if.geometry.bodies import Body, FloatArray

ERROR = 1e-5
"""Coal may say so much more than the true distance [m]: ten times its tolerance."""


class Distances:
    """The bodies as Coal knows them; they stand where they were put last."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        self._shapes = [_shape(body) for body in bodies]
        self._places = [coal.Transform3s() for _ in bodies]
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()
        self.forget()

    def forget(self) -> None:
        """Forget where the bodies stand: the numbers of instants begin anew."""
        self._at = [-1] * len(self._shapes)

    def between(self, sample: int, poses: FloatArray, first: int, second: int) -> float:
        """Return the distance of two bodies [m]; negative if they overlap.

        Args:
            sample: Number of the instant: a body that was put there already is not moved again.
            poses: Of all bodies at that instant, shape (bodies, 4, 4).
            first: Number of one body.
            second: Number of the other.
        """
        for number in (first, second):
            if self._at[number] != sample:
                self._put(number, poses[number])
                self._at[number] = sample
        return self._ask(first, second)

    def points(self, poses: FloatArray, first: int, second: int) -> tuple[FloatArray, FloatArray]:
        """Return the nearest points of two bodies in the root [m]."""
        for number in (first, second):
            self._put(number, poses[number])
            # Put without a number of an instant: the next question has to put it again.
            self._at[number] = -1
        self._ask(first, second)
        one, other = self._result.getNearestPoint1(), self._result.getNearestPoint2()
        return np.array(one).ravel(), np.array(other).ravel()

    def _put(self, number: int, pose: FloatArray) -> None:
        place = self._places[number]
        place.setRotation(pose[:3, :3])
        place.setTranslation(pose[:3, 3])

    def _ask(self, first: int, second: int) -> float:
        # Coal keeps the smallest distance of all questions in a result that is not cleared.
        self._result.clear()
        shapes, places = self._shapes, self._places
        found = coal.distance(
            shapes[first],
            places[first],
            shapes[second],
            places[second],
            self._request,
            self._result,
        )
        return float(found)


def _shape(body: Body) -> coal.CollisionGeometry:
    if body.shape == "box":
        return coal.Box(*body.size)
    if body.shape == "cylinder":
        return coal.Cylinder(*body.size)
    return coal.Sphere(*body.size)
