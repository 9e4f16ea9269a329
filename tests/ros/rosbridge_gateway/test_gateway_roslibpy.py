"""A program with roslibpy, as a process of its own, between real ROS nodes."""

from __future__ import annotations

import json
import math
import sys
import threading

import rospy
from harness.opponents.running_gateway import DEADLINE, RunningGateway
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool

from scara_msgs.srv import MoveTo, MoveToRequest, MoveToResponse

ROSLIBPY = """
import json, os, sys, threading, time
import roslibpy
from roslibpy.core import ServiceException

ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
ros.run(timeout=10)
found = {}
heard = threading.Event()

def take(message):
    found["heard"] = message
    heard.set()

states = roslibpy.Topic(ros, sys.argv[2] + "/twin/joint_states", "sensor_msgs/JointState")
states.subscribe(take)
assert heard.wait(10)
found["time"] = dict(ros.get_time())
found["topics"] = ros.get_topics()
found["type"] = ros.get_service_type(sys.argv[2] + "/move_to")
move_to = roslibpy.Service(ros, sys.argv[2] + "/move_to", "scara_msgs/MoveTo")
request = roslibpy.ServiceRequest({"x": 0.51, "y": 0.16, "z": 0.10})
found["moved"] = dict(move_to.call(request, timeout=10))
try:
    move_to.call(roslibpy.ServiceRequest({"a": 1}), timeout=10)
except ServiceException as error:
    found["refused"] = str(error)

def answer(request, response):
    response["success"] = request["data"]
    response["message"] = "by roslibpy"
    return True

enable = roslibpy.Service(ros, sys.argv[2] + "/enable", "std_srvs/SetBool")
enable.advertise(answer)
told = roslibpy.Topic(ros, sys.argv[2] + "/told", "std_msgs/String", latch=True)
told.publish(roslibpy.Message({"data": json.dumps(found)}))
while not os.path.exists(sys.argv[3]):
    time.sleep(0.02)
os._exit(0)
"""


def test_unmodified_roslibpy_client_is_served(gateway: RunningGateway) -> None:
    """Topics, calls, refusals, an own service, latch and rosapi, all by roslibpy's own code."""
    ros = gateway.ros

    def move(request: MoveToRequest) -> MoveToResponse:
        return MoveToResponse(
            success=True, message=f"{request.x:.2f}", joint_positions=[0.5, math.nan]
        )

    service = rospy.Service(ros.name("move_to"), MoveTo, move)
    script = ros.folder / "client.py"
    script.write_text(ROSLIBPY, encoding="utf-8")
    client = ros.stage.start(
        sys.executable, str(script), str(gateway.port), ros.namespace, str(ros.folder / "go")
    )
    states = ros.publisher("twin/joint_states", JointState)
    ros.wait_until(
        lambda: (
            states.publish(JointState(name=["joint_1"], position=[1.5]))
            or states.get_num_connections()
        ),
        DEADLINE,
    )
    stop = threading.Event()
    ticking = threading.Thread(
        target=lambda: [
            states.publish(JointState(name=["joint_1"], position=[1.5]))
            for _ in iter(lambda: stop.wait(0.05), True)
        ]
    )
    ticking.start()
    try:
        found = json.loads(ros.wait_for_message("told", String, DEADLINE).data)
    finally:
        stop.set()
        ticking.join()
    assert found["heard"]["name"] == ["joint_1"] and found["heard"]["position"] == [1.5]
    assert abs(found["time"]["secs"] - rospy.get_time()) < 60
    assert ros.name("twin/joint_states") in found["topics"] and found["type"] == "scara_msgs/MoveTo"
    assert found["moved"]["success"]
    assert found["moved"]["joint_positions"] == [0.5, None]
    assert found["moved"]["message"] == "0.51"
    allowed = "x, y, z, speed_percent, elbow, asked, has_yaw, yaw, path, speed_mm_s, frame, tool"
    assert found["refused"] == f"a: unknown field: allowed: {allowed}"
    assert ros.service("enable", SetBool)(True).message == "by roslibpy"
    (ros.folder / "go").touch()
    assert client.wait() == 0
    ros.wait_until(
        lambda: ros.name("enable") not in ros.shell("rosservice", "list").split(),
        DEADLINE,
        "the service to go",
    )
    service.shutdown()
