"""The world as the topics of a running cell show it."""

from __future__ import annotations

import contextlib
import json
import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import rosgraph
import rospy
from geometry_msgs.msg import PointStamped
from scara_config.files.yaml_text import parse
from scara_config.payload import Payload
from scara_control.motion.idle_node import HOLD_S, STATE_HOLD_S, Attention
from scara_ros.names import part_name
from scara_ros.shell.ros_node import own_frame
from scara_ros.starting.xmlrpc_guard_io import harden_process
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from scara_msgs.msg import GripperState, MotionState, PayloadState, TwinControllerState
from what_if.cell_files_io import Models
from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.handling import found_part
from what_if.world import Cell, Lag, World

JOINTS, STATE = "twin/joint_states", "twin_controller/state"
MOTION = "joint_pose_controller/state"
PEOPLE = "people/nearest"
CONFIGURATION = "twin_controller/configuration"
TOPICS = {
    JOINTS: JointState,
    "twin/gripper": GripperState,
    "twin/parts": MarkerArray,
    "twin/payload": PayloadState,
    STATE: TwinControllerState,
    MOTION: MotionState,
    PEOPLE: PointStamped,
}
HOLD = {JOINTS: HOLD_S, STATE: STATE_HOLD_S, MOTION: STATE_HOLD_S}
"""What comes all the time is read so often while nobody asks [s], as every resting node does."""
RECENT_S = {JOINTS: 0.02, STATE: 0.1, MOTION: 0.1}
"""What was read so short a time before a question is the newest there is [s]: twice its period."""
FRESH_S = 0.1
"""A question waits so long at most for what is newer; our choice: a quarter of its patience."""
PERSON_S = 5.0
"""A person who was seen so long ago is no longer there; our choice. With monitoring on, the twin
controller stops the pair long before."""
WAIT_S = 2.0
"""A cell that runs publishes its joints and its state within this time; joints that are older are
not known."""


class LiveWorld:
    """Keeps the newest message of each topic and makes a world of them.

    What comes all the time is looked at seldom, and closely when somebody asks.

    Args:
        base: What the topics do not tell.
        models: Dynamics for the payload that the controller was told.

    Attributes:
        is_idle: Says whether nobody needs each message; may be replaced.
    """

    def __init__(self, base: World, models: Models) -> None:
        self._base, self._models = base, models
        self._lock = threading.Lock()
        self._newest: dict[str, tuple[float, Any]] = {}
        # Of each sender: none takes away whom another sees, and a stranger can only add somebody.
        self._people: dict[str, tuple[float, tuple[float, float, float]]] = {}
        self._heard = threading.Condition(self._lock)
        self.is_idle: Callable[[], bool] = lambda: True
        self._attention = {
            topic: Attention(lambda: self.is_idle(), hold) for topic, hold in HOLD.items()
        }
        self._subscribers = [
            rospy.Subscriber(topic, kind, self._keep, topic, queue_size=1, tcp_nodelay=True)
            for topic, kind in TOPICS.items()
        ]

    def stand_in(self, cell: Cell) -> None:
        """Make worlds of this cell from now on."""
        self._base = replace(self._base, cell=cell)

    def close(self) -> None:
        """Listen no longer."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def wait(self, deadline: float) -> bool:
        """Wait for the joints and what the cell latches; return whether the joints are known.

        Args:
            deadline: At most so long [s].
        """
        # Where nobody is near, nobody may ever be told of.
        wanted = set(TOPICS) - {PEOPLE}
        if self._base.cell.work is None:
            wanted -= {"twin/gripper", "twin/parts"}
        with self._heard:
            self._heard.wait_for(lambda: wanted <= set(self._newest), deadline)
            return JOINTS in self._newest

    def now(self) -> World | None:
        """Return the world; None while no joint state is heard.

        It waits a little for the newest joints and state, where it has not been looking.

        Raises:
            WhatIfError: The joints are of another robot.
        """
        asked = time.monotonic()
        for attention in self._attention.values():
            attention.rouse()
        with self._heard:
            self._heard.wait_for(lambda: self._is_fresh(asked), FRESH_S)
            newest = dict(self._newest)
            self._people = {
                sender: (at, place)
                for sender, (at, place) in self._people.items()
                if asked - at <= PERSON_S
            }
            people = tuple(place for _, place in self._people.values())
        # Of a twin that is gone the last pose tells nothing.
        if JOINTS not in newest or asked - newest[JOINTS][0] > WAIT_S:
            return None
        # A joint that is not named stands where it stood at the beginning.
        at = dict(zip(newest[JOINTS][1].name, newest[JOINTS][1].position))
        robot = self._base.cell.robot
        names = [joint.name for joint in robot.twin_joints]
        strange = sorted(at.keys() - set(names))
        if strange and not at.keys() >= set(names):
            what = f"{JOINTS} has {', '.join(strange)}, which {robot.name} has not"
            raise WhatIfError(f"{what}: the running cell has another robot")
        q = tuple(at.get(name, home) for name, home in zip(names, self._base.q))
        world = replace(self._base, q=q)
        if STATE in newest:
            world = commanded(world, newest[STATE][1])
        if MOTION in newest:
            limit = newest[MOTION][1].speed_limit_percent
            world = replace(world, cap_percent=min(world.cap_percent, limit))
        if "twin/payload" in newest:
            message = newest["twin/payload"][1].told
            centre, inertia = message.centre, message.inertia
            payload = Payload(
                number=message.number,
                name=message.name,
                mass_kg=message.mass,
                centre_m=(centre.x, centre.y, centre.z),
                inertia_kg_m2=(inertia.x, inertia.y, inertia.z),
            )
            world = replace(world, payload=payload, models=self._models.told(payload))
        if "twin/parts" in newest:
            gripper = newest.get("twin/gripper")
            held = gripper[1].part if gripper else ""
            world = self._with_parts(world, newest["twin/parts"][1], held)
        return replace(world, people=people)

    def _keep(self, message: Any, topic: str) -> None:
        with self._heard:
            if topic != PEOPLE:
                self._newest[topic] = (time.monotonic(), message)
            else:
                place = (message.point.x, message.point.y, message.point.z)
                frame = own_frame(self._base.cell.robot.base_frame)
                # In another cell's frame, or without a place, it is no sighting.
                if message.header.frame_id.lstrip("/") == frame and all(map(math.isfinite, place)):
                    sender = message._connection_header.get("callerid", "")
                    self._people[sender] = (time.monotonic(), place)
            self._heard.notify_all()
        if topic in self._attention:
            self._attention[topic].hold()

    def _is_fresh(self, asked: float) -> bool:
        """Say whether what comes all the time was read about when it was asked for, or since."""
        if JOINTS not in self._newest:
            return True
        read = {topic: self._newest[topic][0] for topic in RECENT_S if topic in self._newest}
        return all(at >= asked - RECENT_S[topic] for topic, at in read.items())

    def _with_parts(self, world: World, message: MarkerArray, held: str) -> World:
        if world.cell.work is None:
            return world
        named = [(part_name(marker), marker.pose) for marker in message.markers]
        parts = tuple(
            found_part(world.cell, name, _pose(pose), world.q, name == held) for name, pose in named
        )
        return replace(world, parts=parts)


def live_world(base: World, models: Models) -> World | None:
    """Return the world of the cell that runs now; None if none answers. Becomes a node for it.

    Raises:
        WhatIfError: The cell has another robot than ``base``.
    """
    if not rosgraph.is_master_online():
        return None
    # Before the node exists: from then on any web page could send it a shutdown.
    harden_process()
    # The master ends the older of two nodes with one name; Ctrl-C stays the command line's own.
    rospy.init_node("what_if_judge", anonymous=True, disable_signals=True)
    live = LiveWorld(base, models)
    try:
        live.wait(WAIT_S)
        if (found := live.now()) is None:
            return None
        with contextlib.suppress(rospy.ROSException):  # a twin alone tells no configuration
            told = rospy.wait_for_message(CONFIGURATION, String, WAIT_S)
            ours, theirs = base.cell.robot.name, parse(json.loads(told.data)["robot.yaml"])["name"]
            if theirs != ours:
                what = f"the running cell has {theirs}, these files are of {ours}"
                raise WhatIfError(f"{what}: --robot {theirs} or --resting")
        return found
    finally:
        live.close()


def commanded(world: World, state: TwinControllerState) -> World:
    """Return a world with the robot's lag and override as the twin controller knows them."""
    lag = world.lag
    if state.follower_lag > 0.0:
        lag = Lag(state.follower_lag, lag.spread, measured=True)
    # Not the applied speed: while a program runs, that holds the program's own speed already.
    percent = state.real_override_percent
    # 0 means that the controller does not know the override yet.
    return replace(world, lag=lag, override_percent=percent if percent > 0.0 else 100.0)


def _pose(message: Any) -> FloatArray:
    """Return a pose message as a homogeneous transform."""
    x, y, z, w = (getattr(message.orientation, name) for name in "xyzw")
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = message.position.x, message.position.y, message.position.z
    return pose
