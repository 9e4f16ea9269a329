"""Write the URDF of a robot from its profile; no ROS master needed.

Usage: rosrun scara_description write_urdf ROBOT
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import rospkg
import typer
from scara_config import ConfigError, load, load_robot, locate
from scara_ros.shell.command_line_io import CommandLine, choose_robot
from scara_ros.shell.program_io import FAILED

from scara_description.body import load_body, urdf_of
from scara_description.gazebo import CameraView, with_gazebo
from scara_description.inertia import ShapeError
from scara_description.urdf import parse_urdf

app = CommandLine(
    "write_urdf",
    dict.fromkeys((ConfigError, ShapeError, OSError), FAILED),
    help="Write the URDF of a robot from its profile.",
)


@app.command()
def write_urdf(
    robot: Annotated[str, typer.Argument(help="Its folder in config/robots.")],
) -> None:
    """Write the file that robot.yaml names; say what was wrong and leave it as it is otherwise."""
    choose_robot(robot)
    profile = load_robot()
    view = load(locate("camera.yaml"), CameraView)
    text = urdf_of(profile, load_body(profile))
    text = with_gazebo(text, view, parse_urdf(text).root)
    path = Path(rospkg.RosPack().get_path("scara_description")) / "urdf" / profile.urdf
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        print(f"{path}: up to date")
        return
    path.write_text(text, encoding="utf-8")
    print(f"{path}: written")


main = app.run
