"""The camera as a ROS node: it draws what the joints say, while somebody looks."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness.processes import ROSRUN, wait_until
from harness.ros import Ros


@pytest.fixture
def twin(ros: Ros) -> Any:
    """Give a function that publishes a pose of joint_1 as the simulator does, with a stamp."""
    import rospy
    from sensor_msgs.msg import JointState

    publisher = rospy.Publisher(ros.name("twin/joint_states"), JointState, queue_size=1)

    def publish(q: float, seconds: int) -> None:
        state = JointState(name=["joint_1"], position=[q])
        state.header.stamp = rospy.Time(seconds)
        publisher.publish(state)

    yield publish
    publisher.unregister()


def test_camera_draws_the_joints_it_hears_and_says_where_it_stands(ros: Ros, twin: Any) -> None:
    """Size and rate by parameters; picture and intrinsics carry the stamp of the joints.

    Nothing is drawn for nobody.
    """
    from diagnostic_msgs.msg import DiagnosticArray
    from sensor_msgs.msg import CameraInfo, Image
    from tf2_msgs.msg import TFMessage

    reports = ros.collect("/diagnostics", DiagnosticArray)
    places = ros.collect("/tf_static", TFMessage)
    node = ros.run(
        "scara_simulation", "camera", "_width_px:=160", "_height_px:=120", "_frame_rate_hz:=20"
    )

    def said(text: str) -> bool:
        assert node.poll() is None, node.tail()
        return any(
            text in status.message
            for report in reports
            for status in report.status
            if status.name == f"{ros.name('camera')}: pictures"
        )

    wait_until(lambda: said("nobody looks"), 30.0, "a camera that rests")
    wait_until(lambda: bool(places), 10.0, "the camera's frame")
    (place,) = places[0].transforms
    images, infos = (
        ros.collect("camera/image_raw", Image),
        ros.collect("camera/camera_info", CameraInfo),
    )

    def picture(q: float, seconds: int) -> Any:
        def drawn() -> bool:
            twin(q, seconds)
            return any(image.header.stamp.secs == seconds for image in images)

        wait_until(drawn, 20.0, "a picture", period=0.05)
        return next(image for image in images if image.header.stamp.secs == seconds)

    first, second = picture(0.0, 100), picture(0.5, 200)
    assert (first.width, first.height, first.encoding, first.step) == (160, 120, "rgb8", 480)
    assert place.child_frame_id == first.header.frame_id == ros.frame("camera_optical_frame")
    pixels = [np.frombuffer(image.data, np.uint8).reshape(120, 160, 3) for image in (first, second)]
    assert np.count_nonzero((pixels[0] != pixels[1]).any(axis=2)) > 100
    wait_until(lambda: any(info.header.stamp.secs == 200 for info in infos), 10.0, "the intrinsics")
    assert (infos[-1].width, infos[-1].K[2], infos[-1].K[5]) == (160, 79.5, 59.5)


def test_camera_has_a_world_only_while_somebody_looks(ros: Ros, twin: Any) -> None:
    """What it took for the pictures is given back, and the next look finds it again."""
    import rospy
    from sensor_msgs.msg import Image

    # A fork has less for itself alone: it is a program of its own.
    words = (ROSRUN, "scara_simulation", "camera", "_width_px:=160", "_height_px:=120")
    node = ros.stage.start(*words, name="camera")
    wait_until(lambda: "camera is ready" in node.output, 30.0, "the camera")
    before = _private_mb(node.pid)
    for number in (1, 2):
        images: list[Image] = []
        look = rospy.Subscriber(ros.name("camera/image_raw"), Image, images.append, queue_size=1)

        def drawn(seen: list[Image] = images, number: int = number) -> bool:
            twin(0.1, number)
            return any(image.header.stamp.secs == number for image in seen)

        wait_until(drawn, 20.0, "a picture", period=0.05)
        assert _private_mb(node.pid) > before + 20.0
        look.unregister()
        wait_until(lambda: _private_mb(node.pid) < before + 10.0, 20.0, "a camera that rests")


def _private_mb(pid: int) -> float:
    """Return the memory that a process has for itself alone [MB]."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_Dirty")) / 1e3


def test_wrong_parameter_ends_the_camera_with_one_line(ros: Ros) -> None:
    """Exit code 2; the text names the parameter."""
    node = ros.run("scara_simulation", "camera", "_width_px:=4")
    assert node.wait(30.0) == 2
    assert re.search("width_px = 4", node.output) and "Traceback" not in node.output
