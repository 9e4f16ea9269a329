"""The gate of the motion nodes: each motion is judged before its first set point."""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import rospy
from scara_ros.gate.judge_gate_node import JudgeGate
from scara_ros.gate.settings import load_gate
from scara_ros.shell.ros_node import config_folder, refusing
from scara_ros.starting.starting_node import until_shutdown

from scara_control.joint_motion import JointMotion, Vector
from scara_control.kinematics.tool_path import MoveWay
from scara_control.trajectory.goal import Goal
from scara_msgs.msg import Audit
from scara_msgs.srv import JudgeMotion


class Turnstile:
    """Carries out one after the other, in the order in which they came, in a thread of its own."""

    def __init__(self) -> None:
        """Start the thread; it ends with the node."""
        self._waiting: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        threading.Thread(target=self._run, name="turnstile", daemon=True).start()

    def put(self, work: Callable[[], None]) -> None:
        """Append work; returns at once."""
        self._waiting.put(work)

    def _run(self) -> None:
        while True:
            work = self._waiting.get()
            try:
                with until_shutdown():
                    work()
            # A failure must not end the thread, or no later goal would ever begin.
            except Exception:
                rospy.logerr("what was judged failed:\n%s", traceback.format_exc())


def open_gate() -> JudgeGate:
    """Return this node's gate; end the node with code 2 if what_if.yaml is wrong."""
    with refusing():
        settings = load_gate(config_folder())
    return JudgeGate(settings, JudgeMotion, Audit, settings.patience)


def move_request(
    joints: Sequence[str],
    measured: JointMotion | None,
    names: Sequence[str],
    positions: Sequence[float],
    speed_percent: float,
    way: MoveWay | None = None,
) -> dict[str, Any] | None:
    """Return the judge's request for a move of some joints; the others stay.

    Args:
        joints: All of the twin.
        measured: Where they are; None: not known yet.
        names: Joints to move; empty: all.
        positions: [rad] or [m].
        speed_percent: 0: the default.
        way: How it goes there; None: straight to the joints' targets.

    Returns:
        None if it is no move at all, which the node refuses by itself.
    """
    chosen = list(names) or list(joints)
    if measured is None or len(chosen) != len(positions) or not set(chosen) <= set(joints):
        return None
    wanted = dict(zip(joints, measured.q)) | dict(zip(chosen, positions))
    asked = {
        "motion": "MOVE_JOINTS",
        "joint_positions": [wanted[name] for name in joints],
        "speed_percent": speed_percent,
    }
    if way is None:
        return asked
    return asked | {
        "path": way.path,
        "via": [q for place in way.via for q in place],
        "speed_mm_s": way.speed_mm_s,
        "corner_mm": way.corner_mm,
    }


def trajectory_request(goal: Goal) -> dict[str, Any]:
    """Return the judge's request for a trajectory."""
    width = len(goal.names)

    def table(rows: Sequence[Vector]) -> list[float]:
        if not any(len(row) for row in rows):
            return []
        # The message is one flat array: NaN keeps the place of a row that was left out.
        missing = (np.nan,) * width
        return [value for row in rows for value in (row or missing)]

    return {
        "motion": "TRAJECTORY",
        "name": list(goal.names),
        "times": [point.time for point in goal.points],
        "positions": table([point.q for point in goal.points]),
        "velocities": table([point.qdot for point in goal.points]),
        "accelerations": table([point.qddot for point in goal.points]),
    }
