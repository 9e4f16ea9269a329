"""Write what Gazebo and ros_control need of a robot; no ROS master needed.

The elements ``<gazebo>`` of its URDF come from camera.yaml, ``gazebo/ROBOT_controllers.yaml`` from
pid_gains.yaml.

Usage: rosrun scara_description write_gazebo ROBOT
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import rospkg
from scara_config import ConfigError, load, load_robot, locate
from scara_config.profile import CHOICE
from scara_ros.shell.program_io import FAILED, ends_with

from scara_description.gazebo import CameraView, GazeboError, controllers_of, with_gazebo
from scara_description.urdf import UrdfError, parse_urdf


def main() -> None:
    """Write both files of a robot; say what was wrong and leave them as they are otherwise."""
    if len(sys.argv) != 2:
        sys.exit("usage: write_gazebo ROBOT")
    os.environ[CHOICE] = sys.argv[1]
    folder = Path(rospkg.RosPack().get_path("scara_description"))
    with ends_with(
        "write_gazebo", dict.fromkeys((ConfigError, GazeboError, UrdfError, OSError), FAILED)
    ):
        robot = load_robot()
        description = folder / "urdf" / robot.urdf
        controllers = folder / "gazebo" / f"{robot.name}_controllers.yaml"
        view = load(locate("camera.yaml"), CameraView)
        gains = load(locate("pid_gains.yaml"), dict[str, dict[str, dict[str, Any]]])
        text = description.read_text(encoding="utf-8")
        files = {
            description: with_gazebo(text, view, parse_urdf(text).root),
            controllers: controllers_of(robot, gains),
        }
        for path, content in files.items():
            path.write_text(content, encoding="utf-8")
            print(f"{path}: written")
