"""Who may report people to a live twin controller."""

from __future__ import annotations

import sys

from harness.processes import Process
from harness.ros import Ros
from harness.workspace import ROOT

DEADLINE_S = 60.0
SENSOR = b"walking_person"
SIGHTING = "{header: {stamp: now, frame_id: FRAME}, point: {x: 0.4}}"


def controller(ros: Ros) -> Process:
    """Start a twin controller that has neither side; it hears the walking person alone."""
    return ros.run(
        "twin_controller",
        "twin_controller",
        f"_modbus_port:={ros.free_port()}",
        f"_gateway_url:=ws://127.0.0.1:{ros.free_port()}",
    )


def test_senders_that_nobody_named_are_said_once_and_dropped(ros: Ros) -> None:
    """The test and a `rostopic pub`, both many times, then the sensor of examples/."""
    from geometry_msgs.msg import PointStamped
    from rosgraph_msgs.msg import Log

    from scara_msgs.msg import CoreInput

    said = ros.collect("/rosout", Log)
    inputs = ros.collect("twin_controller/inputs", CoreInput)
    controller(ros)
    ros.wait_until(lambda: bool(inputs), DEADLINE_S, "inputs")
    publisher = ros.publisher("people/nearest", PointStamped)
    near = PointStamped()
    near.header.frame_id = ros.frame("base_link")

    def dropped() -> list[str]:
        return [log.msg for log in said if "is dropped: separation.sensors" in log.msg]

    for number in range(1, 4):
        near.header.stamp.secs = number
        publisher.publish(near)
    ros.wait_until(dropped, DEADLINE_S, "the test's own name")
    sighting = SIGHTING.replace("FRAME", ros.frame("base_link"))
    words = ("people/nearest", "geometry_msgs/PointStamped", sighting)
    stranger = ros.stage.start("rostopic", "pub", "-r", "10", *words)
    ros.wait_until(lambda: len(dropped()) >= 2, DEADLINE_S, "the test and another")
    ros.stage.start(sys.executable, str(ROOT / "examples" / "walking_person.py"))
    ros.wait_until(lambda: any(SENSOR in row.data for row in inputs), DEADLINE_S, "the sensor")
    stranger.stop()
    names = [text.split(" is dropped")[0] for text in dropped()]
    assert len(names) == len(set(names)) == 2
    seen = b"".join(row.data for row in inputs)
    assert b"rostopic" not in seen
