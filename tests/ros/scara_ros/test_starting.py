"""A node that starts with or without a master, and ends by a signal, whatever it is doing."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
from harness.ros import Ros

BUSY = """
import os, signal, threading
import rospy
from scara_ros.nodes.starting import become_node, until_shutdown
from std_msgs.msg import String

become_node("busy")
publisher = rospy.Publisher("x", String, queue_size=1)
subscriber = rospy.Subscriber("x", String, lambda message: None)
while not publisher.get_num_connections():
    rospy.rostime.wallsleep(0.01)


class Trap:
    def __init__(self, lock):
        self.lock = lock

    def __enter__(self):
        self.lock.acquire()
        if threading.current_thread() is threading.main_thread():
            os.kill(os.getpid(), signal.{name})

    def __exit__(self, *_):
        self.lock.release()


for connection in publisher.impl.connections:
    connection._lock = Trap(connection._lock)
with until_shutdown():
    while not rospy.is_shutdown():
        publisher.publish("a")
        rospy.rostime.wallsleep(0.02)
print("ended in order")
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_signal_in_the_middle_of_publishing_ends_the_node(
    ros: Ros, tmp_path: Path, name: str
) -> None:
    """The lock that publishing holds is the one that closing the connection needs.

    Rospy's own handler waits for ever.
    """
    script = tmp_path / "busy.py"
    script.write_text(BUSY.replace("{name}", name), encoding="utf-8")
    node = ros.stage.start(sys.executable, str(script))
    assert node.wait(20.0) == 0, node.tail()
    assert "ended in order" in node.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("package", "name"),
    [
        ("scara_control", "kinematics_server"),
        ("cell_recorder", "recorder"),
        ("rosbridge_gateway", "gateway"),
    ],
)
def test_signal_ends_the_waiting_for_a_master(
    ros: Ros, package: str, name: str, number: signal.Signals
) -> None:
    """Any order of start works; what waits can be ended."""
    uri = f"http://127.0.0.1:{ros.free_port()}"
    node = ros.run(package, name, env={"ROS_MASTER_URI": uri})
    ros.wait_until(
        lambda: f"{name}: no roscore at {uri}: waiting for it" in node.output, 20.0, "the remark"
    )
    node.signal(number)
    assert node.wait(10.0) == 0, node.tail()
