"""The workspace's rostest runs as catkin users run it."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.processes import Stage
from harness.workspace import workspace_environment

pytestmark = pytest.mark.system


def test_kinematics_answer_under_rostest(tmp_path: Path) -> None:
    """`rostest scara_bringup kinematics.test` starts a master, the node and the script."""
    env = {**workspace_environment(), "ROS_HOME": str(tmp_path / "ros_home")}
    stage = Stage(tmp_path / "processes", env)
    try:
        process = stage.start("rostest", "scara_bringup", "kinematics.test")
        assert process.wait(60.0) == 0, process.output
        assert "RESULT: SUCCESS" in process.output
        assert "TESTS: 3" in process.output.replace("* ", "").upper(), process.output
    finally:
        stage.close()
