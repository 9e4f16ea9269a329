"""States of joint_pose_controller: the constants of scara_msgs/MotionState, typed."""

from __future__ import annotations

from scara_config.text_enum import StrEnum

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
