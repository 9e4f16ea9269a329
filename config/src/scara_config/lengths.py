"""What follows from the lengths of an arm: it need not be typed, and where it is, it must agree."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

AGREE = 1e-3
"""So far typed places may be from the lengths [m], and directions from each other [1]."""
LONGEST_MM = 1e4
SHORTEST_REACH = 0.75
"""Of the stretched arm: a reach may be counted to the wrist. Our choice."""


def with_lengths(tree: Any) -> Any:
    """Return a parsed robot.yaml with what follows from ``geometry`` and is not in it.

    These are ``reach_mm``, ``home_pose`` and the ``screw_axis`` of each joint of the arm. A joint
    that moves no tool says ``screw_axis: null``; one that counts the other way ``positive: right``
    or ``positive: down``. What fits no SCARA stays as it is.

    Args:
        tree: The parsed file; it is changed.
    """
    size = tree.get("geometry") if isinstance(tree, dict) else None
    joints = tree.get("joints") if isinstance(tree, dict) else None
    if size is None or not isinstance(joints, list):
        return tree
    l1, l2, h = (_length(size, key) for key in ("l1_mm", "l2_mm", "h_mm"))
    # What is typed stays, even if it is wrong: whoever checks the file says so.
    tree.setdefault("reach_mm", l1 + l2)
    tree.setdefault("home_pose", home_of(l1, l2, h))
    arm = [joint for joint in joints if isinstance(joint, dict)]
    arm = [joint for joint in arm if joint.get("screw_axis", ()) is not None]
    turning = [joint.get("type") == "revolute" for joint in arm]
    for joint, screw in zip(arm, screws_of(l1, l2, turning)):
        against = joint.get("positive") == ("down" if joint.get("type") == "prismatic" else "right")
        if against and "screw_axis" not in joint:
            # Taken out, since no joint has such a key: what is not understood stays, a fault.
            del joint["positive"]
            # 0.0 - x and not -x, which makes -0.0 of 0.0.
            screw = [0.0 - value for value in screw]
        joint.setdefault("screw_axis", screw)
    return tree


def _length(size: Any, key: str) -> float:
    """Return a length; any other where it is none, so that the fault is told of it alone."""
    value: Any = size.get(key) if isinstance(size, dict) else None
    # Not by isinstance: true and false are whole numbers to Python.
    if type(value) in (int, float) and abs(value) <= LONGEST_MM:
        return float(value)
    return 100.0


def home_of(l1_mm: float, l2_mm: float, h_mm: float) -> list[list[float]]:
    """Return the tool's pose with all joints at 0: the arm along x, z of the tool down."""
    x, z = (l1_mm + l2_mm) / 1000.0, h_mm / 1000.0
    return [[0.0, -1.0, 0.0, x], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, z], [0.0, 0.0, 0.0, 1.0]]


def screws_of(l1_mm: float, l2_mm: float, turning: Sequence[bool]) -> Iterator[list[float]]:
    """Yield the screw axis of each joint of a SCARA: up is positive, to the left is positive.

    Args:
        l1_mm: From joint 1 to joint 2.
        l2_mm: From joint 2 to the axis of the tool.
        turning: Of each joint of the arm, base to tool: whether it turns.
    """
    places = iter((0.0, l1_mm / 1000.0))
    for turns in turning:
        if turns:
            # From the third turning joint on all stand where the tool is.
            x = next(places, (l1_mm + l2_mm) / 1000.0)
            yield [0.0, 0.0, 1.0, 0.0, 0.0 - x, 0.0]
        else:
            yield [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]


def place_of(screw: Sequence[float] | None) -> tuple[float, float]:
    """Return where a turning joint's upright axis stands [m]."""
    # omega x v is the point of the axis that lies nearest to the origin.
    x, y, _ = _cross((screw or ())[:3], (screw or ())[3:])
    return x, y


def stretched(screws: Sequence[Sequence[float]], tool: Sequence[float]) -> float:
    """Return how far the stretched arm reaches: the distances from axis to axis and to the tool.

    Args:
        screws: Of the joints, base to tool.
        tool: Where it is with all joints at 0 [m].
    """
    place, length = tuple(tool), 0.0
    # From the tool back to the base: each axis is met where it comes nearest to the last point.
    for screw in reversed(screws):
        omega, v = screw[:3], screw[3:]
        # A joint that slides has a direction and no place.
        if any(omega):
            on_axis = _cross(omega, v)
            along = sum(o * (p - a) for o, p, a in zip(omega, place, on_axis))
            nearest = tuple(a + o * along for a, o in zip(on_axis, omega))
            length += math.dist(place, nearest)
            place = nearest
    return length


def slid(screws: Sequence[Sequence[float]], limits: Sequence[tuple[float, float]]) -> float:
    """Return how far the sliding joints carry the tool at most [m]: no length of the arm has it.

    Args:
        screws: Of the joints.
        limits: Their lower and upper limits.
    """
    pairs = zip(screws, limits)
    return sum(max(map(abs, limit)) for screw, limit in pairs if not any(screw[:3]))


def _cross(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )
