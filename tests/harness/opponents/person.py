"""Somebody near the robot, seen by a sensor that is a process of its own.

What a test is busy with is no silence.
"""

from __future__ import annotations

import math
import multiprocessing
import time
from multiprocessing.connection import Connection
from typing import Any

from scara_config import load_robot
from typing_extensions import Self

from harness.ros import Ros
from harness.workspace import ROOT

Place = tuple[float, float, float]
Walk = tuple[float, Place, Place, float]
FAR: Place = (4.0, 0.0, 0.2)
PERIOD_S = 0.05
WALK_M_S = 1.6
"""How fast people walk, ISO 13855; config/twin_controller.yaml reckons with it."""
SILENT = None
ENDED = "ended"


class Person:
    """Somebody whom a sensor sees twenty times a second on ``people/nearest``; a context manager.

    Where the person is, is known for every time of the past: the way is a list of straight walks.
    """

    def __init__(self, ros: Ros) -> None:
        """Be far away."""
        self._walks: list[Walk] = [(time.time(), FAR, FAR, 1.0)]
        context = multiprocessing.get_context("spawn")
        self._line, far = context.Pipe()
        topic = ros.name("people/nearest")
        frame = ros.frame(load_robot(ROOT / "config").base_frame)
        self._process = context.Process(
            target=_serve, args=(far, self._walks[0], topic, frame), daemon=True
        )
        self._process.start()
        far.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._line.send(ENDED)
        self._process.join(10.0)
        self._line.close()

    def stand(self, place: Place) -> float:
        """Be there from now on, and be seen; return when (ROS time)."""
        return self._go(place, place, 1.0)

    def walk(self, end: Place, speed: float = WALK_M_S) -> float:
        """Walk straight to ``end`` and stay; return when it began (ROS time)."""
        return self._go(self.at(time.time()), end, speed)

    def hide(self) -> float:
        """Let the sensor fall silent; return when (ROS time)."""
        self._line.send(SILENT)
        return time.time()

    def at(self, stamp: float) -> Place:
        """Return where the person is at ``stamp`` (ROS time)."""
        return place(
            [walk for walk in self._walks if walk[0] <= stamp or walk is self._walks[0]][-1], stamp
        )

    def _go(self, begin: Place, end: Place, speed: float) -> float:
        walk = (time.time(), begin, end, speed)
        self._walks.append(walk)
        self._line.send(walk)
        return walk[0]


def place(walk: Walk, stamp: float) -> Place:
    """Return where somebody is on a straight walk at ``stamp``."""
    begun, begin, end, speed = walk
    way = math.dist(begin, end)
    share = min(max(0.0, stamp - begun) * speed / way, 1.0) if way else 1.0  # and stays there
    x, y, z = (a + share * (b - a) for a, b in zip(begin, end))
    return x, y, z


def _serve(line: Connection, walk: Walk | None, topic: str, frame: str) -> None:
    """Publish where the person is until told to end.

    ``line`` brings new walks, or that nobody is seen.
    """
    import rospy
    from geometry_msgs.msg import Point, PointStamped

    rospy.init_node("person", disable_signals=True)
    publisher: Any = rospy.Publisher(topic, PointStamped, queue_size=1, tcp_nodelay=True)
    due = time.monotonic()
    while True:
        while line.poll(max(0.0, due - time.monotonic())):
            told = line.recv()
            if told == ENDED:
                rospy.signal_shutdown("the person has gone")
                return
            walk = told
        due = max(due + PERIOD_S, time.monotonic())
        if walk is not None:
            message = PointStamped(point=Point(*place(walk, time.time())))
            message.header.stamp, message.header.frame_id = rospy.get_rostime(), frame
            publisher.publish(message)
