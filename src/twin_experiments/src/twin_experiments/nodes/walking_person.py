"""Node ``walking_person``: a sensor's stand-in that sees one person walk to and fro.

    rosrun twin_experiments walking_person --from 3 0 0 --to 0.9 0 0 --speed 0.5

Publishes: ``people/nearest`` (geometry_msgs/PointStamped in the robot's base frame). It shows how
speed and separation monitoring (``separation.enabled`` in twin_controller.yaml) acts; neither is a
safety function. Exit code: 2 wrong configuration.
"""

from __future__ import annotations

import sys
import time
from typing import Annotated

import rospy
import typer
from geometry_msgs.msg import Point, PointStamped
from scara_config import ConfigError, load_robot
from scara_ros.nodes.own_cell import own_frame

from twin_experiments.nodes.cell import RunError
from twin_experiments.nodes.live.live_twin import enter_ros
from twin_experiments.walk import walked

WRONG, UNUSABLE = 2, 3
READY_S = 30.0

app = typer.Typer(
    add_completion=False, help="Publish a person who walks to and fro near the robot."
)
Place = tuple[float, float, float]


@app.command()
def walking_person(
    begin: Annotated[Place, typer.Option("--from", help="x y z in the robot's base frame [m].")] = (
        3.0,
        0.0,
        0.0,
    ),
    end: Annotated[Place, typer.Option("--to", help="Where the person turns [m].")] = (
        0.9,
        0.0,
        0.0,
    ),
    speed: Annotated[
        float, typer.Option(help="[m/s]; 0: stands at the first place.", min=0.0, max=3.0)
    ] = 0.5,
    rate: Annotated[float, typer.Option(help="Sightings a second.", min=1.0, max=100.0)] = 20.0,
) -> None:
    """Publish until interrupted."""
    try:
        frame = load_robot().base_frame
        # One name: started again it is the same sensor, not another that fell silent.
        enter_ros(
            "walking_person", READY_S, lambda text: typer.echo(text, err=True), anonymous=False
        )
    except (ConfigError, RunError) as error:
        typer.echo(f"walking_person: {error}", err=True)
        raise typer.Exit(WRONG if isinstance(error, ConfigError) else UNUSABLE) from error
    publisher = rospy.Publisher("people/nearest", PointStamped, queue_size=1, tcp_nodelay=True)
    begun = due = time.monotonic()
    while not rospy.is_shutdown():
        message = PointStamped(point=Point(*walked(begin, end, speed, time.monotonic() - begun)))
        message.header.stamp, message.header.frame_id = rospy.get_rostime(), own_frame(frame)
        publisher.publish(message)
        due = max(due + 1.0 / rate, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))


def main() -> None:
    """Run the command."""
    sys.argv[1:] = [word for word in sys.argv[1:] if ":=" not in word]  # rosrun may pass remappings
    app(prog_name="walking_person")
