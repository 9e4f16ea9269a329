"""Node ``robot_state_publisher``: where the links of both robots are, for RViz and other tf users.

It also puts both robots' descriptions where RViz looks for them: the twin and, as a ghost with the
frames ``real/<link>``, the real robot.

Parameters: ``~file`` (URDF; default: that of the chosen robot), ``~config_dir`` (default: package
scara_config), ``~rate`` [Hz] (largest rate of each robot on ``/tf``, 2 to 100, default: 25).
Parameters set: ``robot_description``, ``real/robot_description``, and what the robot's profile
holds: ``profile/robot``, ``profile/pid_gains``, ``profile/modbus_map``.
Topics out: ``/tf`` (moving links, stamp: that of the joint state), ``/tf_static`` (the others,
``world`` and the frames of frames.yaml as ``uframe_<n>`` and ``utool_<n>``, latched),
``robot_description`` and ``real/robot_description`` (std_msgs/String, latched: for recordings and
viewers that ask for a topic). In a namespace all frames carry it in front: ``cell_2/base_link``.
Topics in: ``twin/joint_states``, ``real/joint_states``, only while somebody listens to ``/tf``.
Exit codes: 0 after a signal, 2 when it cannot start.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import rospy
from geometry_msgs.msg import TransformStamped
from scara_config import ConfigError, Robot, load, load_robot, locate
from scara_config.frames import FILE, find_frames
from scara_ros.pacing import Pace
from scara_ros.process.memory_io import keep_for_good
from scara_ros.shell.ros_node import own_frame, starting
from scara_ros.starting.registration_node import keep_parameters
from scara_ros.starting.starting_node import until_shutdown
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from scara_description.frames import (
    FramePose,
    Frames,
    JointStateError,
    frames_of,
    taught_poses,
)
from scara_description.ghost import DescriptionError, ghost_of
from scara_description.taught_frames import flange_in_tool
from scara_description.urdf import UrdfError

NAME = "robot_state_publisher"
PROFILE = ("robot", "pid_gains", "modbus_map")
LOOK_S = 1.0  # our choice: how long a listener waits for its first frame at most
RATE_HZ = 25.0  # our choice: what RViz shows fluently
RATES_HZ = (2.0, 100.0)
"""Allowed rates; our choice. At a lower one, states would wait where they are received and age."""
WARN_S = 10.0  # our choice: between two lines about states that do not fit
QUEUE = 10


def main() -> None:
    """Run the node."""
    with starting(NAME) as folder:
        rate = _rate(rospy.get_param("~rate", RATE_HZ))
        robot = load_robot(folder)
        file = rospy.get_param("~file", "") or robot.description
        twin, real = _describe(Path(str(file)))
        # As parameters can hold them.
        profile = {
            name: as_parameter(load(locate(f"{name}.yaml", folder), dict[str, Any]))
            for name in PROFILE
        }
    described = {"robot_description": twin.text, "real/robot_description": real.text}
    keep_parameters({**described, **{f"profile/{name}": tree for name, tree in profile.items()}})
    told = []
    for name, text in described.items():
        told.append(rospy.Publisher(name, String, queue_size=1, latch=True))
        told[-1].publish(String(text))
    taught = TaughtFrames(folder, robot)
    twin_frames, real_frames = (each.frames.renamed(own_frame) for each in (twin, real))
    publisher = StatePublisher(twin_frames, real_frames, taught, rate)
    # An Event that is waited for knows nothing of the node's end.
    rospy.on_shutdown(publisher.end)
    rospy.loginfo("%s is ready", NAME)
    keep_for_good()
    with until_shutdown():
        publisher.run()
    for topic in told:
        topic.unregister()


@dataclass(frozen=True)
class Description:
    """A URDF and the frames in it."""

    text: str
    frames: Frames


class TaughtFrames:
    """What frames.yaml says, read again when the file has changed."""

    def __init__(self, folder: Path, robot: Robot) -> None:
        """Know nothing yet; taught frames hang in the base and the tool of ``robot``."""
        self._folder, self._flange = folder, flange_in_tool(robot)
        self._names = own_frame(robot.base_frame), own_frame(robot.tool_frame)
        self._stamp: tuple[int, ...] | None = None
        self.poses: tuple[FramePose, ...] = ()

    def changed(self) -> bool:
        """Say whether there is something new, and take it in; a wrong file changes nothing."""
        path = locate(FILE, self._folder)
        there = path.stat() if path.exists() else None
        stamp = (there.st_mtime_ns, there.st_size) if there is not None else ()
        if stamp == self._stamp:
            return False
        # Before it is read, so that a wrong file is told once and not each second.
        self._stamp = stamp
        try:
            self.poses = taught_poses(find_frames(self._folder), *self._names, self._flange)
        except ConfigError as error:
            rospy.logwarn("taught frames stay as they were: %s", error)
            return False
        # In a namespace all frames carry it in front.
        self.poses = tuple(msgspec.structs.replace(p, child=own_frame(p.child)) for p in self.poses)
        return True


class StatePublisher:
    """Publishes both robots' frames, the moving ones while somebody listens."""

    def __init__(self, twin: Frames, real: Frames, taught: TaughtFrames, rate: float) -> None:
        """Advertise, and say where the links are that nothing moves."""
        self._ended = threading.Event()
        self._moving = rospy.Publisher("/tf", TFMessage, queue_size=QUEUE, tcp_nodelay=True)
        self._static = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        self._robots = [
            ShownRobot("twin/joint_states", twin, self._moving, 1.0 / rate),
            ShownRobot("real/joint_states", real, self._moving, 1.0 / rate),
        ]
        self._fixed, self._taught = (*twin.fixed, *real.fixed), taught

    def run(self) -> None:
        """Look once a second who listens and what was taught, until the node ends."""
        first = True
        while not self._ended.is_set():
            if self._taught.changed() or first:
                fixed = (*self._fixed, *self._taught.poses)
                self._static.publish(_message(fixed, rospy.Time.now()))
                first = False
            for robot in self._robots:
                robot.hear(self._moving.get_num_connections() > 0)
            self._ended.wait(LOOK_S)

    def end(self) -> None:
        """End all waiting."""
        self._ended.set()


class ShownRobot:
    """One robot: what its newest joint state says is published, at most once a period."""

    def __init__(
        self, topic: str, frames: Frames, publisher: rospy.Publisher, period: float
    ) -> None:
        """Hear nothing yet."""
        self._topic, self._frames = topic, frames
        self._publisher, self._period = publisher, period
        # Filled anew for each state: making them would take longer than all else here.
        self._transforms = {joint: TransformStamped() for joint in frames.moving}
        self._subscriber: rospy.Subscriber | None = None
        self._lock = threading.Lock()
        self._published: rospy.Time | None = None
        self._warned = Pace(WARN_S)

    def hear(self, wanted: bool) -> None:
        """Hear the joint states only while they are wanted."""
        if wanted and self._subscriber is None:
            self._subscriber = rospy.Subscriber(
                self._topic, JointState, self._take, queue_size=1, tcp_nodelay=True
            )
        elif not wanted and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    def _take(self, state: JointState) -> None:
        """Publish one state, and keep rospy from reading the next one for a period.

        The states that come meanwhile stay in the socket. rospy then reads them at once and throws
        all but the newest away unread, which costs next to nothing. Both robots wait for the same
        instants, so that the processor is woken once.
        """
        with self._lock:  # each publisher of joint states has a thread of its own
            if state.header.stamp != self._published:
                self._published = state.header.stamp
                self._publish(state)
            time.sleep(self._period - time.monotonic() % self._period)

    def _publish(self, state: JointState) -> None:
        try:
            poses = self._frames.moved(state.name, state.position)
        except JointStateError as error:
            if self._warned.is_due(time.monotonic()):
                rospy.logwarn("%s: not shown: %s", rospy.resolve_name(self._topic), error)
            return
        message = TFMessage([self._transforms[name] for name in state.name])
        for transform, pose in zip(message.transforms, poses):
            _fill(transform, pose, state.header.stamp)
        with until_shutdown():
            self._publisher.publish(message)


def _rate(given: object) -> float:
    """Return the parameter ``~rate``."""
    low, high = RATES_HZ
    if isinstance(given, (int, float)) and low <= given <= high:
        return float(given)
    raise ConfigError(f"~rate = {given!r}: must be a number from {low:g} to {high:g} [Hz]")


def _describe(file: Path) -> tuple[Description, Description]:
    """Return the twin and the real robot as ``file`` describes them.

    Raises:
        ConfigError: It cannot be read, or is no description of a robot.
    """
    try:
        twin = file.read_text(encoding="utf-8")
        real = ghost_of(twin)
        return Description(twin, frames_of(twin)), Description(real, frames_of(real))
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, DescriptionError, UrdfError) as error:
        raise ConfigError(f"{file}: {error}") from error


def _message(poses: Iterable[FramePose], stamp: rospy.Time) -> TFMessage:
    poses = list(poses)
    made = [TransformStamped() for _ in poses]
    for transform, pose in zip(made, poses):
        _fill(transform, pose, stamp)
    return TFMessage(made)


def _fill(transform: TransformStamped, pose: FramePose, stamp: rospy.Time) -> None:
    transform.header.stamp, transform.header.frame_id = stamp, pose.parent
    transform.child_frame_id = pose.child
    place, turn = transform.transform.translation, transform.transform.rotation
    place.x, place.y, place.z = pose.xyz
    turn.x, turn.y, turn.z, turn.w = pose.rotation


def as_parameter(tree: Any) -> Any:
    """Return a tree of YAML as a parameter; keys without a value are left out.

    Integers beyond 32 bits become floats, keys become texts.

    Example:
        >>> as_parameter({"joints": ({"name": "joint_1", "alias": None},), 7: 2**40})
        {'joints': [{'name': 'joint_1'}], '7': 1099511627776.0}
    """
    if isinstance(tree, Mapping):
        return {str(key): as_parameter(value) for key, value in tree.items() if value is not None}
    if isinstance(tree, (list, tuple)):
        return [as_parameter(value) for value in tree if value is not None]
    if isinstance(tree, int) and not isinstance(tree, bool) and abs(tree) >= 2**31:
        return float(tree)
    return tree
