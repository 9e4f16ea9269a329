"""Write the URDF of a robot from its profile; no ROS master needed.

Usage: rosrun scara_description write_urdf ROBOT
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import rospkg
from scara_config import ConfigError, load, load_robot, locate
from scara_config.profile import CHOICE
from scara_ros.shell.program_io import FAILED, ends_with

from scara_description.body import load_body, urdf_of
from scara_description.gazebo import CameraView, with_gazebo
from scara_description.inertia import ShapeError
from scara_description.urdf import parse_urdf


def main() -> None:
    """Write the file that robot.yaml names; say what was wrong and leave it as it is otherwise."""
    if len(sys.argv) != 2:
        sys.exit("usage: write_urdf ROBOT")
    os.environ[CHOICE] = sys.argv[1]
    with ends_with("write_urdf", dict.fromkeys((ConfigError, ShapeError, OSError), FAILED)):
        robot = load_robot()
        body = load_body(robot)
        view = load(locate("camera.yaml"), CameraView)
        text = urdf_of(robot, body)
        text = with_gazebo(text, view, parse_urdf(text).root)
        path = Path(rospkg.RosPack().get_path("scara_description")) / "urdf" / robot.urdf
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            print(f"{path}: up to date")
            return
        path.write_text(text, encoding="utf-8")
    print(f"{path}: written")
