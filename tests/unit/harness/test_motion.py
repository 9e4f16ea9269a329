"""When a side stands: read once, and only after it was seen to stand for a while."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest
from harness.wires.motion import ROBOT, SEEN_STILL_S, Motion

JOINT = ROBOT.twin_joints[0]


def told(stamp: float, share: float) -> Any:
    """Return a JointState of one joint at ``share`` of its greatest speed."""
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(to_sec=lambda: stamp)),
        name=[JOINT.name],
        position=[0.0],
        velocity=[share * JOINT.velocity],
    )


def motion(*looks: tuple[float, float]) -> Motion:
    """Return what is known of a side after these looks: stamp [s], share of its speed."""
    side = Motion([JOINT.name])
    side.messages.extend(told(*look) for look in looks)
    return side


def test_side_that_was_looked_at_once_is_not_taken_to_stand() -> None:
    """The first look after a fault may be the last one before its own motion shows."""
    assert motion((9.99, 0.3), (10.01, 0.0)).standstill(10.0) == math.inf


def test_side_stands_from_its_last_moving_look_on() -> None:
    """Said as soon as it was seen to stand for the span, and not before."""
    looks = ((10.00, 0.3), (10.04, 0.1), (10.05, 0.0))
    assert motion(*looks, (10.04 + 0.9 * SEEN_STILL_S, 0.0)).standstill(10.0) == math.inf
    side = motion(*looks, (10.04 + 1.1 * SEEN_STILL_S, 0.0))
    assert side.standstill(10.0) == pytest.approx(0.04)


def test_message_that_comes_while_standstill_is_judged_does_not_make_a_side_stand() -> None:
    """The side moves; its messages come between two looks at the list."""
    side = motion((9.99, 0.3))
    between = side.between

    def growing(begin: float, end: float = math.inf) -> list[Any]:
        seen = between(begin, end)
        side.messages.append(told(10.0 + 0.2 * len(side.messages), 0.3))
        return seen

    side.between = growing  # type: ignore[method-assign]
    assert side.standstill(10.0) == math.inf
