"""Node ``camera``: pictures of the twin's cell, drawn in a process of its own with low priority.

Parameters: ``~config_dir`` (default: package scara_config), ``~width_px``, ``~height_px``,
``~frame_rate_hz``, ``~field_of_view_deg``, ``~position_m``, ``~look_at_m`` (default: camera.yaml).
Topics out: ``camera/image_raw`` (sensor_msgs/Image, rgb8), ``camera/camera_info``, ``/tf_static``
(``camera_optical_frame`` in the root frame of the robot description), ``/diagnostics``.
Topics in: ``twin/joint_states``, ``twin/parts``, only while somebody listens to the pictures: else
nothing is drawn.
Exit codes: 0 after a signal, 2 when it cannot start.
"""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from scara_config import load_robot
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.process.memory_io import give_back
from scara_ros.shell.ros_node import own_frame, starting
from scara_ros.starting.starting_node import until_shutdown
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_ros import StaticTransformBroadcaster
from visualization_msgs.msg import Marker, MarkerArray

from scara_simulation.camera.camera_world_io import CameraWorld, Part
from scara_simulation.camera.config import PARAMETERS, CameraConfig, load_camera

FRAME = "camera_optical_frame"


def main() -> None:
    """Run the node."""
    with starting("camera") as directory:
        given = {
            name: rospy.get_param(f"~{name}") for name in PARAMETERS if rospy.has_param(f"~{name}")
        }
        config = load_camera(directory, given)
        os.nice(config.niceness)
        urdf = load_robot(directory).description
        # Loaded once and put away: what cannot be drawn ends the node now, not when somebody looks.
        with CameraWorld(urdf, config) as world:
            root = world.root
    give_back()
    camera = Camera(urdf, root, config)
    rospy.on_shutdown(camera.wake)
    rospy.loginfo("camera is ready")
    with until_shutdown():
        camera.run()


class Camera:
    """Draws the newest joint positions at the frame rate while somebody listens.

    Only then it has a world to draw, which takes 30 MB and is loaded in 0.1 s.
    """

    def __init__(self, urdf: Path, root: str, config: CameraConfig) -> None:
        """Advertise, and say where the camera stands in the frame ``root``."""
        self._urdf, self._config = urdf, config
        self._world: CameraWorld | None = None
        self._newest: JointState | None = None
        self._fresh = threading.Event()
        self._parts: list[Part] = []
        self._subscribers: list[rospy.Subscriber] = []
        self._drawn, self._spent, self._reported = 0, 0.0, time.monotonic()
        k = config.optics.intrinsics()
        info = CameraInfo(
            height=config.height_px,
            width=config.width_px,
            distortion_model="plumb_bob",
            D=[0.0] * 5,
        )
        info.K, info.R = k.ravel().tolist(), [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        info.P = [*k[0], 0.0, *k[1], 0.0, *k[2], 0.0]
        info.header.frame_id = own_frame(FRAME)
        self._info = info
        self._images = rospy.Publisher("camera/image_raw", Image, queue_size=1)
        self._infos = rospy.Publisher("camera/camera_info", CameraInfo, queue_size=1)
        self._diagnostics = Diagnostics("camera", queue_size=1)
        self._broadcaster = StaticTransformBroadcaster()
        made = TransformStamped(child_frame_id=own_frame(FRAME))
        made.header.stamp, made.header.frame_id = rospy.Time.now(), own_frame(root)
        made.transform.translation = Vector3(*config.position_m)
        made.transform.rotation = Quaternion(*config.pose.quaternion())
        self._broadcaster.sendTransform(made)

    def wake(self) -> None:
        """End the wait for a joint state."""
        self._fresh.set()

    def run(self) -> None:
        """Draw until the node ends, on absolute deadlines.

        Pictures that were not drawn in time are left out.
        """
        period = 1.0 / self._config.frame_rate_hz
        due = time.monotonic()
        try:
            while not rospy.is_shutdown():
                wanted = self._images.get_num_connections() + self._infos.get_num_connections() > 0
                self._listen(wanted)
                if self._world is not None and self._fresh.wait(PERIOD_S):
                    self._draw(self._world)
                self._report()
                due = max(due + period, time.monotonic())
                time.sleep(max(0.0, due - time.monotonic()))
        finally:
            self._put_away()

    def _listen(self, wanted: bool) -> None:
        """Have a world, and hear the joints, only while the pictures are wanted.

        100 messages a second are work too.
        """
        if wanted and self._world is None:
            self._world = CameraWorld(self._urdf, self._config)
            # Set, perhaps, by a state that was heard before the last listener left.
            self._fresh.clear()
            self._subscribers = [
                rospy.Subscriber(
                    "twin/joint_states", JointState, self._take, queue_size=1, tcp_nodelay=True
                ),
                rospy.Subscriber(
                    "twin/parts", MarkerArray, self._take_parts, queue_size=1, tcp_nodelay=True
                ),
            ]
        elif not wanted and self._world is not None:
            for subscriber in self._subscribers:
                subscriber.unregister()
            self._subscribers = []
            self._put_away()

    def _put_away(self) -> None:
        """Free the world, if there is one."""
        if self._world is not None:
            self._world.close()
            self._world = None
            give_back()

    def _take(self, message: JointState) -> None:
        self._newest = message
        self._fresh.set()

    def _take_parts(self, message: MarkerArray) -> None:
        self._parts = [
            _part(m)
            for m in message.markers
            if m.type == Marker.CYLINDER and m.action == Marker.ADD
        ]

    def _draw(self, world: CameraWorld) -> None:
        """Publish one picture with the stamp of the joints in it."""
        # Before the newest is taken: a state that comes during the drawing is drawn next.
        self._fresh.clear()
        newest = self._newest
        if newest is None or rospy.is_shutdown():
            return
        began = time.monotonic()
        world.place(dict(zip(newest.name, newest.position)))
        world.place_parts(self._parts)
        pixels = world.picture()
        height, width, depth = pixels.shape
        image = Image(
            height=height, width=width, encoding="rgb8", step=width * depth, data=pixels.tobytes()
        )
        image.header.stamp, image.header.frame_id = newest.header.stamp, own_frame(FRAME)
        self._info.header.stamp = newest.header.stamp
        self._images.publish(image)
        self._infos.publish(self._info)
        self._drawn += 1
        self._spent += time.monotonic() - began

    def _report(self) -> None:
        """Tell once a second how many pictures were drawn, and what they took."""
        now = time.monotonic()
        passed = now - self._reported
        if passed < PERIOD_S:
            return
        text = (
            f"{self._drawn / passed:.1f} pictures a second" if self._subscribers else "nobody looks"
        )
        if self._subscribers and not self._drawn:
            text = "no joint states"
        each = 1e3 * self._spent / self._drawn if self._drawn else 0.0
        values = {"a picture takes [ms]": f"{each:.1f}"}
        self._diagnostics.publish(
            Diagnosis(Level.OK, f"{rospy.get_name()}: pictures", text, values)
        )
        self._drawn, self._spent, self._reported = 0, 0.0, now


def _part(marker: Marker) -> Part:
    place, turn, colour = marker.pose.position, marker.pose.orientation, marker.color
    return Part(
        position=(place.x, place.y, place.z),
        orientation=(turn.x, turn.y, turn.z, turn.w),
        radius=marker.scale.x / 2.0,
        height=marker.scale.z,
        colour=(colour.r, colour.g, colour.b, 1.0),
    )
