"""The twin's payload as the motion nodes hear it."""

from __future__ import annotations

from collections.abc import Callable

from scara_config import Robot
from scara_config.payload import Payload

from scara_control.config import MotionConfig
from scara_control.dynamics.effort import Load, load_of
from scara_msgs.msg import Payload as PayloadMessage
from scara_msgs.msg import PayloadState

GRAVITY = 9.81
"""[m/s^2], standard gravity, rounded."""
_MOST_LOADS = 4
"""So many are kept ready (our choice: with and without a part, for two payloads)."""


class PayloadListener:
    """Turns what the twin carries into the load that motion is planned for.

    Args:
        robot: Its URDF is read when a payload is heard of.
        config: motion.yaml.
        deliver: Gets the load, None without a payload; in rospy's thread.
    """

    def __init__(
        self, robot: Robot, config: MotionConfig, deliver: Callable[[Load | None], None]
    ) -> None:
        self._robot, self._percent, self._deliver = robot, config.move.effort_percent, deliver
        self._carried: tuple[Payload, ...] = ()
        # A part is gripped and let go all day.
        self._loads: dict[tuple[Payload, ...], Load] = {}

    def __call__(self, message: PayloadState) -> None:
        """Take in a message; nothing is delivered if the load is as before."""
        carried = [_payload(message.told)] + ([_payload(message.part)] if message.holding else [])
        found = tuple(payload for payload in carried if payload.mass_kg)
        if found == self._carried:
            return
        if found and found not in self._loads:
            if len(self._loads) >= _MOST_LOADS:
                # Each has an engine of its own; one that is planned with lives on with its plan.
                self._loads.clear()
            self._loads[found] = self._load(found)
        self._deliver(self._loads.get(found))
        # Only now: a payload whose model has failed is tried again with the next message.
        self._carried = found

    def _load(self, carried: tuple[Payload, ...]) -> Load:
        # Only here: the engine takes memory, and most cells carry nothing.
        from scara_control.dynamics.arm_model_io import ArmModel

        joints = self._robot.twin_joints
        model = ArmModel(
            self._robot.description,
            [joint.name for joint in joints],
            self._robot.tool_frame,
            gravity=GRAVITY,
            payloads=carried,
        )
        return load_of(model, joints, self._percent)


def _payload(message: PayloadMessage) -> Payload:
    centre, inertia = message.centre, message.inertia
    return Payload(
        number=message.number,
        name=message.name,
        mass_kg=message.mass,
        centre_m=(centre.x, centre.y, centre.z),
        inertia_kg_m2=(inertia.x, inertia.y, inertia.z),
    )
