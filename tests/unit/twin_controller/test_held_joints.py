"""What joints hold that the twin's coming set points do not name."""

from __future__ import annotations

from typing import Any

import pytest
from harness.pair import SETUP
from scara_control.joint_motion import JointMotion, Setpoints
from twin_controller.twin.fields import PacketError
from twin_controller.twin.held_joints import HeldJoints
from twin_controller.twin.packets import twin_plan

NAMES = SETUP.names
STANDS = (0.0,) * 4


def measured(*q: float, qdot: tuple[float, ...] = STANDS) -> JointMotion:
    """Return where the joints are."""
    return JointMotion.measured(q, qdot, 100.0)


def packet(names: list[str], *rows: list[float], **derivatives: Any) -> dict[str, Any]:
    """Return coming set points, 10 ms apart, of some joints."""
    points = [
        {
            "positions": row,
            "velocities": [],
            "accelerations": [],
            "time_from_start": {"secs": 0, "nsecs": k * 10_000_000},
        }
        | derivatives
        for k, row in enumerate(rows)
    ]
    header = {"stamp": {"secs": 100, "nsecs": 0}, "frame_id": ""}
    return {"header": header, "joint_names": names, "points": points}


@pytest.fixture
def held() -> HeldJoints:
    """Return a memory that has seen the joints stand."""
    made = HeldJoints(SETUP.joints)
    made.measure(measured(0.1, 0.2, -0.1, 0.4))
    return made


def test_missing_joints_hold_where_they_are_measured(held: HeldJoints) -> None:
    """In the core's order, at rest; derivatives that were left out are zeros."""
    message = packet(["table_joint", "joint_1"], [0.5, 0.11], [0.6, 0.12])
    plan = twin_plan(message, NAMES, 1.0, held)
    rows = ((0.11, 0.2, -0.1, 0.5), (0.12, 0.2, -0.1, 0.6))
    assert plan.setpoints == Setpoints.due(
        NAMES, (0.0, 0.01), tuple(map(JointMotion.at_rest, rows))
    )
    assert plan.stamp == 100.0


def test_derivatives_of_named_joints_are_kept(held: HeldJoints) -> None:
    """Those of the others are zeros."""
    message = packet(["joint_2"], [0.2], velocities=[0.7], accelerations=[0.8])
    plan = twin_plan(message, NAMES, 1.0, held)
    (point,) = plan.setpoints.points
    assert point.qdot == (0.0, 0.7, 0.0, 0.0) and point.qddot == (0.0, 0.8, 0.0, 0.0)


def test_joints_of_others_are_left_away(held: HeldJoints) -> None:
    """A gripper's joint may be in the same message."""
    plan = twin_plan(packet(["gripper", "joint_1"], [9.0, 0.11]), NAMES, 1.0, held)
    assert plan.rows == ((0.0, (0.11, 0.2, -0.1, 0.4)),)


def test_within_a_stream_a_joint_holds_one_place(held: HeldJoints) -> None:
    """What the motion of the others does to its measurement is no set point."""
    first = twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.0, held)
    held.measure(measured(0.11, 0.201, -0.1, 0.4, qdot=(1.0, 0.3, 0.0, 0.0)))
    second = twin_plan(packet(["joint_1"], [0.12]), NAMES, 1.01, held)
    assert second.rows[0][1][1:] == first.rows[0][1][1:]


def test_a_joint_goes_on_to_hold_the_end_of_the_set_points_before(held: HeldJoints) -> None:
    """Not where it is measured on its way there."""
    twin_plan(packet(["joint_2"], [0.2], [0.205]), NAMES, 1.0, held)
    assert twin_plan(packet(["joint_1"], [0.1]), NAMES, 1.1, held).rows[0][1][1] == 0.205


def test_another_stream_begins_where_the_joints_are(held: HeldJoints) -> None:
    """Meanwhile somebody may have moved them by a step."""
    twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.0, held)
    held.measure(measured(0.11, 0.203, -0.1, 0.4))
    assert twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.51, held).rows[0][1][1] == 0.203


def test_a_joint_that_was_taken_elsewhere_holds_there_once_it_stands(held: HeldJoints) -> None:
    """As long as it moves nobody knows what it will do."""
    twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.0, held)
    held.measure(measured(0.11, 0.5, -0.1, 0.4, qdot=(0.0, 1.0, 0.0, 0.0)))
    with pytest.raises(PacketError, match="joint_2 missing, and it moves"):
        twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.1, held)
    held.measure(measured(0.11, 0.6, -0.1, 0.4))
    assert twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.2, held).rows[0][1][1] == 0.6


def test_without_a_measurement_a_missing_joint_is_an_error(held: HeldJoints) -> None:
    """Likewise on a new connection; set points of all joints need none."""
    held.forget()
    with pytest.raises(PacketError, match="joint_2 missing, and never measured"):
        twin_plan(packet(["joint_1"], [0.11]), NAMES, 1.0, held)
    whole = twin_plan(packet(list(NAMES), [0.1, 0.2, 0.3, 0.4]), NAMES, 1.0, held)
    assert whole.rows == ((0.0, (0.1, 0.2, 0.3, 0.4)),)


@pytest.mark.parametrize("names", [[], ["gripper"], None])
def test_set_points_of_none_of_our_joints_are_refused(
    held: HeldJoints, names: list[str] | None
) -> None:
    """There is nothing to follow."""
    with pytest.raises(PacketError, match="joint_names"):
        twin_plan(packet(names or [], [0.0]) | {"joint_names": names}, NAMES, 1.0, held)


def test_the_converter_says_which_joint_nobody_knows() -> None:
    """It invents none."""
    given = Setpoints.due(("a",), (0.0,), (JointMotion((1.0,), (), ()),))
    assert given.completed(("b", "a"), {"b": 2.0}).points[0] == JointMotion.at_rest((2.0, 1.0))
    with pytest.raises(KeyError, match="b"):
        given.completed(("a", "b"), {})
