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


ENDLESS = """
import threading
import rospy
from rospy.impl.registration import RegManager, get_registration_listeners
from scara_ros.nodes.ending import wait_for_end
from scara_ros.nodes.starting import become_node

become_node("patient")
(manager,) = [
    found for found in get_registration_listeners().listeners if isinstance(found, RegManager)
]
plain, waits, sleepers = manager.cond.wait, threading.Event(), []


def for_good(timeout=None):
    sleepers.append(threading.current_thread())
    waits.set()
    return plain()


with manager.cond:
    manager.cond.wait = for_good
    manager.cond.notify_all()
waits.wait()
print("waits", flush=True)
wait_for_end()
(ending,) = [thread for thread in threading.enumerate() if thread.name == "ending"]
ending.join()
print("still asleep" if sleepers[0].is_alive() else "woken", flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_end_does_not_wait_for_rospys_pauses(
    ros: Ros, tmp_path: Path, number: signal.Signals
) -> None:
    """Rospy's thread that connects topics sleeps for 0.5 s at a time; here it sleeps for ever."""
    script = tmp_path / "patient.py"
    script.write_text(ENDLESS, encoding="utf-8")
    node = ros.stage.start(sys.executable, str(script))
    ros.wait_until(lambda: "waits" in node.output, 20.0, "a thread that sleeps for ever")
    node.signal(number)
    assert node.wait(20.0) == 0, node.tail()
    assert "woken" in node.output


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
