"""A node outlives a full log disk, and no web page ends it."""

from __future__ import annotations

import http.client
import socket
import sys
import xmlrpc.client
from pathlib import Path
from urllib.parse import urlsplit

import rosgraph
from diagnostic_msgs.msg import DiagnosticArray
from harness.ros import Ros
from std_srvs.srv import Trigger

from scara_msgs.srv import ForwardKinematics

CHATTY = """
import rospy
from scara_ros.diagnostics_node import Diagnostics
from scara_ros.starting.starting_node import become_node, until_shutdown
from std_srvs.srv import Trigger, TriggerResponse

def change_mode(_):
    rospy.logerr("the mode has changed")
    print("on the screen too", flush=True)
    return TriggerResponse(True, "")

become_node("chatty")
rospy.Service("change_mode", Trigger, change_mode)
diagnostics = Diagnostics("chatty")
with until_shutdown():
    while not rospy.is_shutdown():
        diagnostics.publish()
        rospy.rostime.wallsleep(0.1)
"""


def test_a_node_on_a_full_log_disk_answers_and_says_what_is_lost(ros: Ros, tmp_path: Path) -> None:
    """Screen and log file answer ENOSPC; the node works on and warns on /diagnostics."""
    (tmp_path / "log").mkdir()
    log = f"{ros.name('chatty').lstrip('/').replace('/', '_')}.log"
    (tmp_path / "log" / log).symlink_to("/dev/full")
    (tmp_path / "chatty.py").write_text(CHATTY, encoding="utf-8")
    said = ros.collect("/diagnostics", DiagnosticArray)
    node = ros.stage.start(
        "bash",
        "-c",
        f"exec {sys.executable} {tmp_path}/chatty.py >/dev/full 2>&1",
        env={"ROS_LOG_DIR": str(tmp_path / "log"), "PYTHONUNBUFFERED": "1"},
    )
    change_mode = ros.service("change_mode", Trigger)
    assert [change_mode().success for _ in range(3)] == [True] * 3
    assert node.poll() is None

    def warned() -> list[str]:
        name = ros.name("chatty/log")
        return [s.message for m in list(said) for s in m.status if s.name == name and s.level == 1]

    assert "No space left on device" in ros.wait_until(warned, 10.0, "a WARN")[-1]


def test_no_web_page_ends_a_node(ros: Ros) -> None:
    """What a browser would send is refused and logged; the node goes on."""
    node = ros.run("scara_control", "kinematics_server")
    ros.wait_for_service("forward_kinematics")
    master = rosgraph.Master("/tests")
    uri = urlsplit(master.lookupNode(ros.name("kinematics_server")))
    body = xmlrpc.client.dumps(("/evil", "from a page"), "shutdown")
    for headers in ({"Origin": "http://localhost:3000"}, {"Host": "evil.example"}):
        connection = http.client.HTTPConnection(str(uri.hostname), uri.port, timeout=5.0)
        connection.request("POST", "/", body, headers)
        assert connection.getresponse().status == 403
        connection.close()
    ros.wait_until(lambda: "refused 1 requests" in node.output, 5.0, "the remark")
    assert node.poll() is None
    assert rosgraph.Master("/tests").lookupNode(ros.name("kinematics_server")) == uri.geturl()


def test_a_client_that_says_nothing_keeps_nobody_out(ros: Ros) -> None:
    """Who calls a service beside it is answered."""
    ros.run("scara_control", "kinematics_server")
    call = ros.service("forward_kinematics", ForwardKinematics)
    found = urlsplit(rosgraph.Master("/tests").lookupService(ros.name("forward_kinematics")))
    # Connections are accepted in turn: the silent one first.
    with socket.create_connection((str(found.hostname), int(found.port or 0)), timeout=5.0):
        assert call(joint_positions=[0.0, 0.0, -0.16, 0.0]).success
