"""roslibpy's own tests for ROS 1, as its authors publish them, against a live gateway.

Only `./cell test --clients` has them. They connect to port 9090, which has to be free.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pytest
import roslib.packages
from harness.clients.environments import INSTALLED, Environment, installed
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros

PORT = 9090
NEEDS = {
    "test_add_two_ints_service": "rospy_tutorials",
    "test_tf_test": "tf2_web_republisher",
}
"""ROS packages that a test needs and does not bring."""
VERSION = "from importlib.metadata import version; print(version('roslibpy'))"


@pytest.mark.parametrize(
    "client", [pytest.param(client, id=client.name) for client in installed("roslibpy_*")]
)
def test_own_tests_of_roslibpy_pass_but_for_packages_that_are_missing(
    ros: Ros, client: Environment, tmp_path: Path, record: dict[Any, Any]
) -> None:
    """Nothing is adapted; what fails is what this machine has no package for."""
    gateway = RunningGateway(ros, port=PORT)
    report = tmp_path / "report.xml"
    words = ("-m", "pytest", "-q", "tests/ros1", f"--junitxml={report}", "-p", "no:cacheprovider")
    process = ros.stage.start(
        *(client.program, *words), env=client.variables, cwd=INSTALLED / client.name / "source"
    )
    process.wait(300.0)
    cases = ElementTree.parse(report).getroot().iter("testcase")
    failed = {
        str(case.get("name")).partition("[")[0]: case.find("failure") is not None
        or case.find("error") is not None
        for case in cases
    }
    missing = {test for test, package in NEEDS.items() if not _there(package)}
    wrong = {test for test, has_failed in failed.items() if has_failed}
    check = f"its own tests for ROS 1, but {len(missing)} of {len(failed)} for missing packages"
    version = ros.shell(client.program, "-c", VERSION).strip()
    found = record.setdefault(("roslibpy", version), {})
    found[check] = f"{', '.join(sorted(wrong))}" if wrong - missing else None
    assert wrong - missing == set(), process.tail()
    assert missing <= wrong and len(failed) > 20, failed
    assert gateway.node.poll() is None


def _there(package: str) -> bool:
    try:
        roslib.packages.get_pkg_dir(package)
    except roslib.packages.InvalidROSPkgException:
        return False
    return True
