"""Hear where the twin's joints are and ask for a tool pose: roslibpy, a running cell, no ROS."""

import sys
import threading

import roslibpy

cell = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]) if len(sys.argv) > 1 else 9090)
try:
    cell.run(timeout=2.0)
except roslibpy.core.RosTimeoutError:
    sys.exit("no gateway answers: start a cell first (./cell up)")
heard = threading.Event()
states = roslibpy.Topic(cell, "/twin/joint_states", "sensor_msgs/JointState")
states.subscribe(lambda state: (print(state["name"], state["position"]), heard.set()))
heard.wait(10)
kinematics = roslibpy.Service(cell, "/forward_kinematics", "scara_msgs/ForwardKinematics")
print(dict(kinematics.call(roslibpy.ServiceRequest({"joint_positions": [0.0, 0.0, 0.0]}))))
cell.terminate()
