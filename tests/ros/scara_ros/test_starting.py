"""A node that starts with or without a master, and ends by a signal, whatever it is doing."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
import rospy
from harness.ros import Ros
from harness.running.thorough import thorough

BUSY = """
import os, signal, threading
import rospy
from scara_ros.starting.starting_node import become_node, until_shutdown
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


@pytest.mark.parametrize("name", ["SIGINT", *thorough("SIGTERM")])
def test_signal_in_the_middle_of_publishing_ends_the_node(
    ros: Ros, tmp_path: Path, name: str
) -> None:
    """Publishing holds the lock that closing needs; rospy's own handler waits for ever."""
    script = tmp_path / "busy.py"
    script.write_text(BUSY.replace("{name}", name), encoding="utf-8")
    node = ros.stage.start(sys.executable, str(script))
    assert node.wait(20.0) == 0, node.tail()
    assert "ended in order" in node.output


ENDLESS = """
import threading
import rospy
from rospy.impl.registration import RegManager, get_registration_listeners
from scara_ros.starting.registration_node import wait_for_end
from scara_ros.starting.starting_node import become_node

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


@pytest.mark.parametrize("number", [signal.SIGTERM, *thorough(signal.SIGINT)])
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


DEAF = """
import signal
from scara_ros.starting.registration_node import wait_for_end
from scara_ros.starting.starting_node import SIGNALS, become_node

become_node("deaf")
signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
print("waits", flush=True)
wait_for_end()
"""
"""Another thread gets the signal, and the main thread sleeps on: Python's handler never runs."""


def test_signal_that_does_not_wake_the_main_thread_ends_the_node(ros: Ros, tmp_path: Path) -> None:
    """So it was with one that came just before the main thread began to wait."""
    script = tmp_path / "deaf.py"
    script.write_text(DEAF, encoding="utf-8")
    node = ros.stage.start(sys.executable, str(script))
    ros.wait_until(lambda: "waits" in node.output, 20.0, "a main thread that waits")
    node.signal(signal.SIGINT)
    assert node.wait(10.0) == 0, node.tail()


@pytest.mark.parametrize(
    ("package", "name", "number"),
    [
        ("scara_control", "kinematics_server", signal.SIGINT),
        ("cell_recorder", "recorder", signal.SIGTERM),
        *thorough(
            ("scara_control", "kinematics_server", signal.SIGTERM),
            ("cell_recorder", "recorder", signal.SIGINT),
        ),
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


def answers(ros: Ros, service: str) -> bool:
    """Return whether a service answers to its name."""
    try:
        rospy.wait_for_service(ros.name(service), timeout=0.2)
    except rospy.ROSException:
        return False
    return True


@pytest.mark.parametrize(
    ("package", "name", "ready"),
    [
        ("scara_control", "kinematics_server", "forward_kinematics"),
        *thorough(
            ("scara_control", "joint_pose_controller", "joint_pose_controller/move"),
            ("what_if", "what_if", "what_if/judge"),
        ),
    ],
)
def test_a_second_node_of_a_name_says_so_and_leaves_the_first_alone(
    ros: Ros, package: str, name: str, ready: str
) -> None:
    """One line, and the service of the first one goes on; under another name it may run."""
    first = ros.run(package, name)
    ros.wait_until(lambda: answers(ros, ready), 30.0, ready)
    second = ros.run(package, name)
    assert second.wait(20.0) == 1
    said = second.output.splitlines()
    (line,) = [line for line in said if not line.startswith("pybullet build time")]
    assert line.startswith(f"{name}: {ros.namespace}/{name} runs already, as process {first.pid}")
    assert line.endswith(f"__name:={name}_2")
    assert first.poll() is None and answers(ros, ready)
    first.signal(signal.SIGKILL)
    first.wait(10.0)
    again = ros.run(package, name)
    ros.wait_until(lambda: answers(ros, ready), 30.0, "the node that came after a killed one")
    assert again.poll() is None
