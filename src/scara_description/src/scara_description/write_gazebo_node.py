"""Write what Gazebo and ros_control need of a robot; no ROS master needed.

The elements ``<gazebo>`` of its URDF come from camera.yaml, ``gazebo/ROBOT_controllers.yaml`` from
pid_gains.yaml.

Usage: rosrun scara_description write_gazebo ROBOT
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import rospkg
import typer
from scara_config import ConfigError, load, load_robot, locate
from scara_ros.shell.command_line_io import CommandLine, choose_robot
from scara_ros.shell.program_io import FAILED

from scara_description.gazebo import CameraView, GazeboError, controllers_of, with_gazebo
from scara_description.urdf import UrdfError, parse_urdf

app = CommandLine(
    "write_gazebo",
    dict.fromkeys((ConfigError, GazeboError, UrdfError, OSError), FAILED),
    help="Write what Gazebo and ros_control need of a robot.",
)


@app.command()
def write_gazebo(
    robot: Annotated[str, typer.Argument(help="Its folder in config/robots.")],
) -> None:
    """Write both files of a robot; say what was wrong and leave them as they are otherwise."""
    choose_robot(robot)
    folder = Path(rospkg.RosPack().get_path("scara_description"))
    profile = load_robot()
    description = folder / "urdf" / profile.urdf
    controllers = folder / "gazebo" / f"{profile.name}_controllers.yaml"
    view = load(locate("camera.yaml"), CameraView)
    gains = load(locate("pid_gains.yaml"), dict[str, dict[str, dict[str, Any]]])
    text = description.read_text(encoding="utf-8")
    # Both texts are made before a file is written: if one fails, both stay as they were.
    files = {
        description: with_gazebo(text, view, parse_urdf(text).root),
        controllers: controllers_of(profile, gains),
    }
    for path, content in files.items():
        path.write_text(content, encoding="utf-8")
        print(f"{path}: written")


main = app.run
