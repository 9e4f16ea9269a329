"""Packets of the twin are checked where they come in: names, counts, finite numbers, types."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import pytest
from harness.pair import HOME, SETUP
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion, Setpoints
from twin_controller.core.actions import Command, FollowTwin, SendTwin
from twin_controller.core.events import ClockProbe, TwinMeasured, TwinMotion, TwinPlan
from twin_controller.core.lead.effects import TO_TWIN
from twin_controller.twin.fields import PacketError
from twin_controller.twin.packets import (
    clock_probe,
    command_packet,
    end_packet,
    follow_packet,
    twin_measured,
    twin_motion,
    twin_plan,
)

NAMES = SETUP.names
STAMP = {"stamp": {"secs": 100, "nsecs": 250_000_000}, "frame_id": ""}
ZERO = [0.0] * 4


def joint_state(**changes: Any) -> dict[str, Any]:
    """Return a joint state of the twin with some fields changed."""
    return {
        "header": STAMP,
        "name": list(NAMES),
        "position": [1, 2.0, 3.0, 4.0],
        "velocity": ZERO,
        "effort": [],
    } | changes


def point(due_ms: int, **changes: Any) -> dict[str, Any]:
    """Return one set point due after ``due_ms``."""
    due = {"secs": 0, "nsecs": due_ms * 1_000_000}
    return {
        "positions": ZERO,
        "velocities": ZERO,
        "accelerations": ZERO,
        "time_from_start": due,
    } | changes


def trajectory(*points: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """Return the twin's coming set points with some fields changed."""
    return {"header": STAMP, "joint_names": list(NAMES), "points": list(points)} | changes


def motion_state(**changes: Any) -> dict[str, Any]:
    """Return the state of joint_pose_controller with some fields changed."""
    fields = {"state": "idle", "last_command_id": 7, "standing_still": True, "message": ""}
    return (
        fields
        | {f"speed_{kind}_percent": 10.0 for kind in ("requested", "applied", "limit")}
        | {"peak_percent": 30.0}
        | changes
    )


def test_a_joint_state_becomes_an_input_in_the_cores_order() -> None:
    """The wire's order of joints is its own; more joints than ours are allowed."""
    order = ["table_joint", "gripper", "joint_3", "joint_2", "joint_1"]
    message = joint_state(name=order, position=[4, 9, 3, 2, 1], velocity=[0.4, 9, 0.3, 0.2, 0.1])
    assert twin_measured(message, NAMES, 5.0) == TwinMeasured(
        5.0, JointMotion.measured((1.0, 2.0, 3.0, 4.0), (0.1, 0.2, 0.3, 0.4), 100.25)
    )


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"name": list(NAMES[:3]), "position": ZERO[:3], "velocity": ZERO[:3]},
            "name = .*: table_joint missing",
        ),
        (
            {"name": [*NAMES, "joint_1"], "position": [*ZERO, 1.0], "velocity": [*ZERO, 0.0]},
            "name = .*: joint_1 more than once",
        ),
        ({"name": None}, "name: missing"),
        ({"name": "joint_1"}, "name: missing"),
        ({"position": ZERO[:3]}, r"position: expected 4 numbers, got \[0.0, 0.0, 0.0\]"),
        ({"position": [*ZERO, 0.0]}, "position: expected 4 numbers"),
        ({"position": None}, "position: expected 4 numbers, got None"),
        ({"velocity": []}, "velocity: expected 4 numbers"),
        ({"position": [0.0, math.nan, 0.0, 0.0]}, "position = .*: not finite"),
        ({"position": [0.0, None, 0.0, 0.0]}, "position = .*: not finite"),
        ({"position": [0.0, "1.0", 0.0, 0.0]}, "position = .*: not finite"),
        ({"position": [0.0, True, 0.0, 0.0]}, "position = .*: not finite"),
        ({"position": [0.0, 10**400, 0.0, 0.0]}, "position = .*: not finite"),
        ({"velocity": [0.0, math.inf, 0.0, 0.0]}, "velocity = .*: not finite"),
        ({"header": None}, "header: missing"),
        ({"header": {}}, "stamp = None: expected secs and nsecs"),
        ({"header": {"stamp": {"secs": 1.5, "nsecs": 0}}}, "stamp = .*: expected secs and nsecs"),
        (
            {"header": {"stamp": {"secs": 10**400, "nsecs": 0}}},
            "stamp = .*: expected secs and nsecs",
        ),
    ],
)
def test_a_bad_joint_state_is_refused(changes: dict[str, Any], text: str) -> None:
    """The text names the field and what was expected."""
    with pytest.raises(PacketError, match=text):
        twin_measured(joint_state(**changes), NAMES, 0.0)


def test_coming_set_points_become_a_plan() -> None:
    """Times from the stamp, rows in the core's order."""
    order = list(reversed(NAMES))
    message = trajectory(point(0), point(10, positions=[4, 3, 2, 1]), joint_names=order)
    plan = twin_plan(message, NAMES, 5.0)
    points = tuple(map(JointMotion.at_rest, ((0.0,) * 4, (1.0, 2.0, 3.0, 4.0))))
    assert plan == TwinPlan(5.0, 100.25, Setpoints.due(NAMES, (0.0, 0.01), points))


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (trajectory(), "points: empty"),
        (trajectory(points=None), "points: empty"),
        (trajectory(point(0), joint_names=["joint_1"]), "joint_2, joint_3, table_joint missing"),
        (trajectory(point(10), point(10)), "points: point 1: time .* is not after point 0"),
        (trajectory(point(10), point(0)), "is not after"),
        (trajectory(point(0, positions=ZERO[:3])), "positions: expected 4 numbers"),
        (trajectory(point(0, velocities=[0.0])), "velocities: expected 4 numbers"),
        (trajectory(point(0, velocities=None)), "velocities: expected 4 numbers, got None"),
        (
            trajectory(point(0, accelerations=[math.nan, 0.0, 0.0, 0.0])),
            "accelerations = .*: not finite",
        ),
        (
            trajectory(point(0, time_from_start=None)),
            "time_from_start = None: expected secs and nsecs",
        ),
        (trajectory(None), "time_from_start = None"),  # type: ignore[arg-type]
        (trajectory("point"), "time_from_start = None"),  # type: ignore[arg-type]
        (trajectory(point(0), header=None), "header: missing"),
    ],
)
def test_bad_set_points_are_refused(message: dict[str, Any], text: str) -> None:
    """Likewise."""
    with pytest.raises(PacketError, match=text):
        twin_plan(message, NAMES, 0.0)


def test_the_state_of_the_pose_controller_becomes_an_input() -> None:
    """Field by field."""
    message = motion_state(
        state="moving", standing_still=False, message="busy", speed_limit_percent=80
    )
    assert twin_motion(message, NAMES, 5.0) == TwinMotion(
        5.0, "moving", 10.0, 10.0, 80.0, 7, False, "busy", (), 30.0
    )


def test_the_end_of_a_running_move_is_part_of_the_state() -> None:
    """In the core's order; no move, no target."""
    order = list(reversed(NAMES))
    message = motion_state(state="moving", name=order, target=[4, 3, 2, 1])
    assert twin_motion(message, NAMES, 0.0).target == (1.0, 2.0, 3.0, 4.0)
    assert twin_motion(motion_state(name=order, target=[]), NAMES, 0.0).target == ()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"target": [1.0], "name": list(NAMES)}, "target: expected 4 numbers"),
        ({"target": [1.0, 2.0, math.nan, 4.0], "name": list(NAMES)}, "target = .*: not finite"),
        (
            {"target": [1.0], "name": ["joint_1"]},
            "name = .*: joint_2, joint_3, table_joint missing",
        ),
        ({"target": [1.0]}, "name: missing"),
    ],
)
def test_a_bad_target_is_refused(changes: dict[str, Any], text: str) -> None:
    """A way that is judged has to be the way that is driven."""
    with pytest.raises(PacketError, match=text):
        twin_motion(motion_state(**changes), NAMES, 0.0)


@pytest.mark.parametrize("field", sorted(motion_state()))
def test_a_state_without_a_field_is_refused(field: str) -> None:
    """All fields are needed."""
    message = motion_state()
    del message[field]
    with pytest.raises(PacketError, match=field):
        twin_motion(message, NAMES, 0.0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"speed_limit_percent": math.nan}, "speed_limit_percent = nan: expected a finite number"),
        ({"speed_limit_percent": "80"}, "speed_limit_percent = '80': expected a finite number"),
        (
            {"speed_requested_percent": True},
            "speed_requested_percent = True: expected a finite number",
        ),
        ({"last_command_id": "seven"}, "last_command_id = 'seven'"),
        ({"last_command_id": None}, "last_command_id = None"),
        ({"last_command_id": math.nan}, "last_command_id = nan: expected int"),
        ({"last_command_id": -1}, "last_command_id = -1: expected a uint32"),
        ({"last_command_id": 10**400}, "last_command_id = a huge number: expected a uint32"),
        ({"state": "dancing"}, "state = 'dancing': expected one of idle, announcing"),
        ({"standing_still": "no"}, "standing_still = 'no'"),
        ({"state": 3}, "state = 3"),
        ({"message": None}, "message = None"),
    ],
)
def test_a_state_of_the_wrong_type_is_refused(changes: dict[str, Any], text: str) -> None:
    """Nothing is converted silently: a text "no" is not True."""
    with pytest.raises(PacketError, match=text):
        twin_motion(motion_state(**changes), NAMES, 0.0)


def test_the_answer_of_the_twins_clock_becomes_a_probe() -> None:
    """Its time, and when we asked and heard."""
    assert clock_probe({"time": {"secs": 7, "nsecs": 500_000_000}}, 1.0, 1.5) == ClockProbe(
        1.5, 1.0, 1.5, 7.5
    )


@pytest.mark.parametrize(
    "values",
    [{}, {"time": None}, {"time": 7.5}, {"time": {"secs": 7}}, {"time": {"secs": "7", "nsecs": 0}}],
)
def test_an_answer_without_a_time_is_refused(values: dict[str, Any]) -> None:
    """A clock that says nothing is not believed."""
    with pytest.raises(PacketError, match=r"time = .*: expected secs and nsecs"):
        clock_probe(values, 1.0, 1.5)


@given(stamp=st.floats(0.0, 4e9), q=st.tuples(*[st.floats(-5.0, 5.0)] * 4))
def test_a_set_point_for_the_twin_survives_the_wire(stamp: float, q: tuple[float, ...]) -> None:
    """What is sent reads back as the same plan, its stamp to the nanosecond."""
    motion = JointMotion(q, q, q)
    packet = json.loads(json.dumps(follow_packet(FollowTwin(stamp, (motion,)), NAMES)))
    plan = twin_plan(packet, NAMES, 0.0)
    assert plan.stamp == pytest.approx(stamp, abs=1e-9 + 1e-6)
    assert plan.setpoints == Setpoints.due(NAMES, (0.0,), (motion,))
    assert 0 <= packet["header"]["stamp"]["nsecs"] < 1_000_000_000


def test_a_packet_without_points_ends_the_following() -> None:
    """Nothing in it can be a set point."""
    packet = end_packet(7.25)
    assert packet["points"] == [] and packet["header"]["stamp"] == {"secs": 7, "nsecs": 250_000_000}
    with pytest.raises(PacketError, match="joint_1, joint_2, joint_3, table_joint missing"):
        twin_plan(packet, NAMES, 0.0)


@pytest.mark.parametrize(
    ("do", "command"),
    [
        (Command.STOP_TWIN, 1),
        (Command.PAUSE_TWIN, 2),
        (Command.RESUME_TWIN, 3),
        (Command.ESTOP_TWIN, 4),
        (Command.RESET_TWIN, 5),
    ],
)
def test_a_command_to_the_twin_carries_its_id_and_reason(do: Command, command: int) -> None:
    """Numbers of scara_msgs/MotionCommand."""
    packet = command_packet(SendTwin(do, "because", 12), 7.25)
    assert (packet["command"], packet["id"], packet["reason"]) == (command, 12, "because")
    assert packet["header"] == {
        "stamp": {"secs": 7, "nsecs": 250_000_000},
        "frame_id": "twin_controller",
    }


def test_the_command_numbers_are_those_of_the_message() -> None:
    """Read from MotionCommand.msg, so that the two cannot drift apart."""
    from harness.workspace import ROOT

    text = (ROOT / "src" / "scara_msgs" / "msg" / "MotionCommand.msg").read_text(encoding="utf-8")
    numbers = {
        name: int(number) for name, number in re.findall(r"^uint8 (\w+)=(\d+)", text, re.MULTILINE)
    }
    sent = {
        do.name.removesuffix("_TWIN"): command_packet(SendTwin(do, "", 1), 0.0)["command"]
        for do in TO_TWIN
    }
    assert sent == numbers


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=5), inner, max_size=5)
    ),
    max_leaves=8,
)


FIELDS = [
    *((twin_measured, joint_state, field) for field in ("header", "name", "position", "velocity")),
    *((twin_plan, trajectory, field) for field in ("header", "joint_names", "points")),
    *((twin_plan, lambda **changes: trajectory(point(0, **changes)), field) for field in point(0)),
    *((twin_motion, motion_state, field) for field in sorted(motion_state())),
]


@given(where=st.sampled_from(FIELDS), value=JSON)
def test_whatever_stands_in_a_field_only_packet_errors_come_out(where: Any, value: Any) -> None:
    """The link's thread survives any packet, and what passes is finite."""
    convert, packet, field = where
    try:
        event = convert(packet(**{field: value}), NAMES, 0.0)
    except PacketError:
        return
    if isinstance(event, TwinMotion):
        assert math.isfinite(event.speed_limit_percent) and isinstance(event.state, str)
    else:
        motion = event.motion if isinstance(event, TwinMeasured) else event.setpoints.points[0]
        assert len(motion.q) == len(HOME) and all(map(math.isfinite, motion.q))
