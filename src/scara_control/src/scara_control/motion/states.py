"""States of joint_pose_controller: the constants of scara_msgs/MotionState, typed; its phases."""

from __future__ import annotations

from enum import Enum

from scara_config.text_enum import StrEnum

from scara_control.motion.commands import Command
from scara_msgs.msg import MotionState


class State(StrEnum):
    """What joint_pose_controller does."""

    IDLE = MotionState.IDLE
    ANNOUNCING = MotionState.ANNOUNCING
    MOVING = MotionState.MOVING
    FOLLOWING = MotionState.FOLLOWING
    PAUSING = MotionState.PAUSING
    PAUSED = MotionState.PAUSED
    STOPPING = MotionState.STOPPING
    ESTOPPED = MotionState.ESTOPPED


class Phase(Enum):
    """What is done about the path under way."""

    GOING = "it is followed; so is none"
    HELD = "it slows down, and waits on its way"
    PARKED = "it waits, and its set points at rest are sent"
    STOPPING = "a ramp has taken its place"


HOLDING = (Phase.HELD, Phase.PARKED)
"""Between PAUSE and RESUME."""
AFTER = {
    (Phase.GOING, Command.PAUSE): Phase.HELD,
    (Phase.HELD, Command.RESUME): Phase.GOING,
    (Phase.PARKED, Command.RESUME): Phase.GOING,
}
"""What PAUSE and RESUME make of a phase; of any other nothing: a ramp goes on to its end."""
