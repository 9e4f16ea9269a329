"""The messages that bear upstream's names are upstream's.

The checksums that other people's nodes compare.
"""

from __future__ import annotations

from importlib import import_module

import pytest

UPSTREAM = {
    "industrial_msgs/RobotStatus": "b733cb45a38101840b75c4c0d6093d19",
    "control_msgs/FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
    "control_msgs/FollowJointTrajectoryGoal": "69636787b6ecbde4d61d711979bc7ecb",
    "control_msgs/FollowJointTrajectoryResult": "493383b18409bfb604b4e26c676401d2",
    "control_msgs/FollowJointTrajectoryFeedback": "10817c60c2486ef6b33e97dcd87f4474",
    "control_msgs/JointTolerance": "f544fe9c16cf04547e135dd6063ff5be",
}


@pytest.mark.parametrize(("name", "checksum"), UPSTREAM.items())
def test_checksum_is_upstreams(name: str, checksum: str) -> None:
    """Names, types and order of all fields and constants are in it."""
    package, kind = name.split("/")
    assert getattr(import_module(f"{package}.msg"), kind)._md5sum == checksum
