"""What Gazebo and ros_control need to run a cell: elements of the URDF, and a controllers.yaml.

The twin runs in PyBullet here; this is for whoever has Gazebo classic. The plugins are the
article's: gazebo_ros_control and a camera. Names are those of the twin's topics.

Source: gazebo_ros_control's and gazebo_ros_camera's documented elements; field of view: pinhole
camera, tan(h / 2) / tan(v / 2) = width / height.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import msgspec
from scara_config import Robot

from scara_description.urdf import WORLD, in_world

NAMESPACE = "twin"
PUBLISH_HZ = 100  # as the simulator publishes twin/joint_states
# All from our comment to the end: what a person adds has to stand in front of it.
_BLOCK = re.compile(r"^  <!-- For Gazebo.*?(?=^</robot>)", re.DOTALL | re.MULTILINE)
_KINDS = {
    "position": "effort_controllers/JointPositionController",
    "velocity": "effort_controllers/JointVelocityController",
}


class GazeboError(ValueError):
    """The description has no end that the elements could stand before."""


class CameraView(msgspec.Struct, frozen=True):
    """The keys of camera.yaml that a simulated camera needs."""

    width_px: int
    height_px: int
    frame_rate_hz: float
    field_of_view_deg: float
    position_m: tuple[float, float, float]
    look_at_m: tuple[float, float, float]
    near_m: float
    far_m: float

    @property
    def horizontal_fov(self) -> float:
        """Field of view across the picture [rad]; camera.yaml has the one from top to bottom."""
        upright = math.tan(0.5 * math.radians(self.field_of_view_deg))
        return 2.0 * math.atan(upright * self.width_px / self.height_px)

    @property
    def rpy(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw [rad] of a camera that looks along its x, with z up."""
        x, y, z = (to - at for to, at in zip(self.look_at_m, self.position_m))
        return 0.0, math.atan2(-z, math.hypot(x, y)), math.atan2(y, x)


def with_gazebo(description: str, view: CameraView, root: str) -> str:
    """Return a URDF with the elements for Gazebo; those of an earlier call are replaced.

    Args:
        description: URDF as text.
        view: The camera, in the frame ``root``.
        root: Root link of the description.

    Raises:
        GazeboError: There is no line ``</robot>``.
    """
    plain = _BLOCK.sub("", description)
    if "\n</robot>" not in plain:
        raise GazeboError("the robot description has no line </robot>")
    head, _, tail = plain.rpartition("\n</robot>")
    return "\n".join([head, *_elements(view, root), f"</robot>{tail}"])


def _elements(view: CameraView, root: str) -> list[str]:
    pose = " ".join(f"{value:.9g}" for value in (*view.position_m, *view.rpy))
    return [
        "  <!-- For Gazebo classic, which is not run here; "
        "write_gazebo writes it from camera.yaml. -->",
        *(in_world(root) if root != WORLD else ()),
        "  <gazebo>",
        '    <plugin name="gazebo_ros_control" filename="libgazebo_ros_control.so">',
        f"      <robotNamespace>{NAMESPACE}</robotNamespace>",
        "      <robotParam>robot_description</robotParam>",
        "      <robotSimType>gazebo_ros_control/DefaultRobotHWSim</robotSimType>",
        "    </plugin>",
        "  </gazebo>",
        f'  <gazebo reference="{root}">',
        '    <sensor name="camera" type="camera">',
        f"      <pose>{pose}</pose>",
        f"      <update_rate>{view.frame_rate_hz:g}</update_rate>",
        "      <camera>",
        f"        <horizontal_fov>{view.horizontal_fov:.9g}</horizontal_fov>",
        f"        <image><width>{view.width_px}</width><height>{view.height_px}</height>"
        "<format>R8G8B8</format></image>",
        f"        <clip><near>{view.near_m:g}</near><far>{view.far_m:g}</far></clip>",
        "      </camera>",
        '      <plugin name="camera_controller" filename="libgazebo_ros_camera.so">',
        "        <alwaysOn>true</alwaysOn>",
        # With 0 the plugin leaves the rate to the sensor's update_rate.
        "        <updateRate>0</updateRate>",
        "        <cameraName>camera</cameraName>",
        "        <imageTopicName>image_raw</imageTopicName>",
        "        <cameraInfoTopicName>camera_info</cameraInfoTopicName>",
        "        <frameName>camera_optical_frame</frameName>",
        "      </plugin>",
        "    </sensor>",
        "  </gazebo>",
    ]


def controllers_of(robot: Robot, gains: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Return a controllers.yaml of ros_control for the twin's joints.

    Args:
        robot: The joints.
        gains: Content of pid_gains.yaml: joint, loop (position, velocity), gain.
    """
    lines = [
        "# For ros_control in Gazebo classic, which is not run here. write_gazebo writes it from",
        "# pid_gains.yaml: change that. The gains are those of the simulator, which adds gravity,",
        "# inertia and friction as feed-forward; ros_control adds none, so its joints lag by more.",
        f"{NAMESPACE}:",
        f"  joint_state_controller: {{type: joint_state_controller/JointStateController, "
        f"publish_rate: {PUBLISH_HZ}}}",
    ]
    for joint in robot.twin_joints:
        for loop, kind in _KINDS.items():
            pid = ", ".join(
                f"{name}: {str(value).lower() if isinstance(value, bool) else value}"
                for name, value in gains[joint.name][loop].items()
            )
            lines += [
                f"  {joint.name}_{loop}_controller:",
                f"    type: {kind}",
                f"    joint: {joint.name}",
                f"    pid: {{{pid}}}",
            ]
    return "\n".join([*lines, ""])
