"""Types are described as rosapi describes them."""

from __future__ import annotations

from typing import Any

import genpy.dynamic
import pytest
import roslib.message
from geometry_msgs.msg import PoseWithCovarianceStamped
from rosbridge_gateway.rosapi.typedefs import typedefs
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger

from scara_msgs.msg import MotionState

FIND = roslib.message.get_message_class
FIELDS = {
    *("type", "fieldnames", "fieldtypes", "fieldarraylen", "examples"),
    *("constnames", "constvalues"),
}


def test_nested_type_is_described_once_each_in_the_order_of_its_fields() -> None:
    """Header with its time first, then the pose; a fixed array tells its length."""
    found = typedefs(PoseWithCovarianceStamped, FIND)
    assert [one["type"] for one in found] == [
        "geometry_msgs/PoseWithCovarianceStamped",
        "std_msgs/Header",
        "time",
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
    ]
    assert all(one.keys() == FIELDS for one in found)
    assert found[1] == {
        "type": "std_msgs/Header",
        "fieldnames": ["seq", "stamp", "frame_id"],
        "fieldtypes": ["uint32", "time", "string"],
        "fieldarraylen": [-1, -1, -1],
        "examples": ["0", "{}", ""],
        "constnames": [],
        "constvalues": [],
    }
    assert found[2]["fieldnames"] == ["secs", "nsecs"]
    assert found[3]["fieldarraylen"] == [-1, 36] and found[3]["examples"] == ["{}", "[]"]


def test_constants_are_told_by_name() -> None:
    """Sorted, values as text."""
    found = typedefs(MotionState, FIND)[0]
    assert found["constnames"] == sorted(found["constnames"]) and found["constnames"]
    for name, value in zip(found["constnames"], found["constvalues"]):
        assert str(getattr(MotionState, name)) == value


@pytest.mark.parametrize(
    ("kind", "name", "fields"),
    [
        (SetBoolRequest, "std_srvs/SetBoolRequest", ["data"]),
        (SetBoolResponse, "std_srvs/SetBoolResponse", ["success", "message"]),
        (Trigger._request_class, "std_srvs/TriggerRequest", []),
    ],
)
def test_parts_of_a_service_have_their_own_names(
    kind: type[Any], name: str, fields: list[str]
) -> None:
    """As their Python classes."""
    found = typedefs(kind, FIND)
    assert [(one["type"], one["fieldnames"]) for one in found] == [(name, fields)]


def test_request_class_of_the_service_is_the_one_described() -> None:
    """What the gateway looks up for service_request_details."""
    assert SetBool._request_class is SetBoolRequest


def test_all_kinds_of_fields_have_a_type_a_length_and_an_example() -> None:
    """Every primitive type, alone, as an array and with a fixed length."""
    integers = [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
    kinds = [*integers, "float32", "float64", "bool", "string", "byte", "char", "time", "duration"]
    text = "\n".join(f"{k} a{n}\n{k}[] b{n}\n{k}[3] c{n}" for n, k in enumerate(kinds))
    made = genpy.dynamic.generate_dynamic("test_msgs/All", text)["test_msgs/All"]
    found = typedefs(made, FIND)
    assert [one["type"] for one in found] == ["test_msgs/All", "time", "duration"]
    assert found[0]["fieldtypes"] == [kind for kind in kinds for _ in range(3)]
    assert found[0]["fieldarraylen"] == [-1, 0, 3] * len(kinds)
    message = made()
    for name, length, example, kind in zip(
        found[0]["fieldnames"],
        found[0]["fieldarraylen"],
        found[0]["examples"],
        found[0]["fieldtypes"],
    ):
        plain = str(getattr(message, name)) if kind not in ("time", "duration") else "{}"
        assert example == (plain if length < 0 else "[]"), name
