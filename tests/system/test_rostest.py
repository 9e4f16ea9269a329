"""The workspace's rostests run as catkin users run them."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.processes import Stage, free_port
from harness.workspace import ROOT, workspace_environment

pytestmark = pytest.mark.system
TESTS = {
    "scara_control/controllers": 7,
    "scara_simulation/simulator": 3,
    "twin_controller/pair": 3,
    "scara_bringup/cell": 1,
}
"""Package and file: how many tests it has."""
PORTS = ("modbus_port", "gateway_port")


def test_every_rostest_is_run() -> None:
    """kinematics.test asks a part of what controllers.test asks."""
    found = {f"{file.parts[-3]}/{file.stem}" for file in ROOT.glob("src/*/test/*.test")}
    assert found == {*TESTS, "scara_control/kinematics"}


@pytest.mark.parametrize("test", TESTS)
def test_rostest_succeeds(tmp_path: Path, test: str) -> None:
    """`rostest PACKAGE FILE` starts a master, the nodes and the script."""
    env = {**workspace_environment(), "ROS_HOME": str(tmp_path / "ros_home")}
    stage = Stage(tmp_path / "processes", env)
    package, name = test.split("/")
    launch = (ROOT / "src" / package / "test" / f"{name}.test").read_text(encoding="utf-8")
    ports = [f"{port}:={free_port()}" for port in PORTS if f'arg name="{port}"' in launch]
    try:
        process = stage.start("rostest", package, f"{name}.test", *ports)
        assert process.wait(150.0) == 0, process.output
        assert "RESULT: SUCCESS" in process.output
        said = process.output.replace("* ", "").upper()
        assert f"TESTS: {TESTS[test]}\n" in said, process.output
    finally:
        stage.close()
