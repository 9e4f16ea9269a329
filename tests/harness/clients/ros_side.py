"""The ROS side of what other people's programs are tried with: nodes that publish, answer, echo."""

from __future__ import annotations

import threading
from typing import Any

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestResult
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse

from harness.ros import Ros

PERIOD = 0.05
"""Seconds between two joint states."""
PIXELS = bytes(range(12))
"""The image: two rows of two pixels, rgb8."""


class RosSide:
    """Below the test's namespace, in the test's own process.

    ``states`` and ``image`` are published, ``question`` is echoed on ``answer`` and kept in the
    parameter ``asked``, ``switch`` is offered. Who publishes on ``use_lamp`` has the service
    ``lamp`` called, and what came of it latched on the topic that the message names. The action
    ``count`` counts up to its goal.
    """

    def __init__(self, ros: Ros) -> None:
        self._ros, self._asked = ros, ros.name("asked")
        self._lamp = rospy.ServiceProxy(ros.name("lamp"), SetBool)
        # Latched: a client's subscription may connect after its question was heard. Each asks once.
        self._answer = rospy.Publisher(ros.name("answer"), String, latch=True, queue_size=1)
        self._states = rospy.Publisher(ros.name("states"), JointState, queue_size=1)
        self._image = rospy.Publisher(ros.name("image"), Image, latch=True, queue_size=1)
        self._image.publish(Image(width=2, height=2, encoding="rgb8", step=6, data=PIXELS))
        self._handles: list[Any] = [
            *(self._answer, self._states, self._image),
            rospy.Subscriber(ros.name("question"), String, self._echo),
            rospy.Subscriber(ros.name("use_lamp"), String, self._use_lamp),
        ]
        self._switch = rospy.Service(ros.name("switch"), SetBool, self._switched)
        self._count = actionlib.ActionServer(
            ros.name("count"), TestAction, self._counted, auto_start=False
        )
        self._count.start()
        self._stop = threading.Event()
        self._publishing = threading.Thread(target=self._publish)
        self._publishing.start()

    def close(self) -> None:
        """Leave."""
        self._stop.set()
        self._publishing.join()
        self._switch.shutdown()
        self._count.stop()
        for handle in self._handles:
            handle.unregister()

    def _publish(self) -> None:
        while not self._stop.wait(PERIOD):
            self._states.publish(JointState(name=["joint_1"], position=[0.5]))

    def _echo(self, question: String) -> None:
        self._answer.publish(question)
        rospy.set_param(self._asked, question.data)

    def _switched(self, request: SetBoolRequest) -> SetBoolResponse:
        return SetBoolResponse(True, "on" if request.data else "off")

    def _use_lamp(self, question: String) -> None:
        try:
            answer = self._lamp(True)
            told = f"{answer.success} {answer.message}"
        except rospy.ServiceException as error:
            told = f"failed: {error}"
        # A topic for each use: on one for all, what is latched would be that of the use before, and
        # what is not would be lost while only the last use's subscription is still connected.
        used = rospy.Publisher(self._ros.name(question.data), String, latch=True, queue_size=1)
        used.publish(told)
        self._handles.append(used)

    def _counted(self, handle: actionlib.ServerGoalHandle) -> None:
        wanted = handle.get_goal().goal
        handle.set_accepted()
        for number in range(1, wanted + 1):
            self._stop.wait(PERIOD)
            handle.publish_feedback(TestFeedback(number))
        handle.set_succeeded(TestResult(wanted))
