r"""Where a step that turns the tool leads; pure.

The tool keeps its place and turns about an axis through it. Inverse kinematics asked by the twin
controller keep the tool turned as at home, so the joints are found here, by Newton's method:

.. math:: q \leftarrow q + J^{+} \, (p^* - p, \; e(R^*, R))

The step is then a move of the joints, and the twin controller judges it as any other move.

Source: Lynch & Park, Modern Robotics (2017), sec. 6.2; starting from where the arm is: our choice.
"""

from __future__ import annotations

import math

import numpy as np
from scara_config import Robot

from operator_panel.control.jog import JogError
from operator_panel.control.steps import StepError
from operator_panel.control.tool_jog import TURNS, ToolArm, turn_between

TRIES = 30  # our choice: a step of 10 deg takes five or six
FOUND = 1e-7  # our choice: m and rad alike; a ten-thousandth of the smallest step
FAR = math.pi / 2  # our choice: [rad] or m; joints that far away are another way of standing
LEAVES_M = 2e-3  # our choice: so far the tool may leave its place on the way
LOOKS = 8  # our choice: so often the way is looked at


def why_no_turns(robot: Robot, instead: str = "Step joint") -> str:
    """Return why this arm's tool cannot be turned in its place; words for the operator.

    Args:
        robot: Its joints.
        instead: The way of jogging that turns what can be turned.
    """
    missing = [
        joint.name for joint in robot.joints if joint.screw_axis is not None and not joint.twin
    ]
    if missing:
        names = " and ".join(missing)
        return f"Not on this robot: its twin has no {names}, which turns the tool."
    return (
        f"Not on this robot: {len(robot.arm_joints)} joints cannot turn the tool and keep its "
        f"place. Use {instead}."
    )


def turn_step(
    arm: ToolArm, now: dict[str, float], axis: str, step_deg: float, frame: str
) -> list[float]:
    """Return the target of MOVE_JOINTS [rad] or [m], in the order of the twin's joints.

    Args:
        arm: The joints that move the tool.
        now: Where the joints are [rad] or [m].
        axis: rx, ry or rz.
        step_deg: How far, with its sign [deg].
        frame: About whose axis: ``world``, ``tool`` or a user frame.

    Raises:
        StepError: The arm cannot turn its tool, not from here, or a joint would leave its range.
        JogError: The frame has been taken away meanwhile.
    """
    if axis not in arm.axes or axis not in TURNS:
        raise StepError(why_no_turns(arm.robot))
    begin = arm.pose(now)
    index = TURNS.index(axis)
    about = arm.axes_of(frame, begin)[:, index]
    wanted = begin.copy()
    # The rotation by angle [rad] about a unit vector (Rodrigues' formula)
    angle = math.radians(step_deg)
    x, y, z = about
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: np.ndarray = np.eye(3) + math.sin(angle) * cross
    turned += (1.0 - math.cos(angle)) * cross @ cross
    wanted[:3, :3] = turned @ begin[:3, :3]
    found = _joints_of(arm, now, wanted)
    for joint in arm.joints:
        q = found[joint.name]
        if not joint.lower <= q <= joint.upper:
            low, high = joint.lower / joint.scale, joint.upper / joint.scale
            raise StepError(
                f"{joint.name} = {q / joint.scale:.2f} {joint.unit} is outside "
                f"{low:g} to {high:g} {joint.unit}"
            )
    # Raise StepError if the tool would leave its place: all joints go there evenly
    place = arm.pose(now)[:3, 3]
    farthest = 0.0
    for share in np.linspace(0.0, 1.0, LOOKS):
        between = {name: q + share * (found[name] - q) for name, q in now.items()}
        farthest = max(farthest, float(np.linalg.norm(arm.pose(between)[:3, 3] - place)))
    if farthest > LEAVES_M:
        raise StepError(
            f"the tool would leave its place by {1e3 * farthest:.1f} mm on the way, allowed are "
            f"{1e3 * LEAVES_M:g} mm: choose a smaller step, or jog a joint first"
        )
    return [found[joint.name] for joint in arm.robot.twin_joints]


def _joints_of(arm: ToolArm, now: dict[str, float], wanted: np.ndarray) -> dict[str, float]:
    """Return the joints near ``now`` with which the tool is at ``wanted``.

    Raises:
        StepError: The arm is stretched out or folded, or no such joints were found.
    """
    found = dict(now)
    for _ in range(TRIES):
        pose = arm.pose(found)
        off = np.concatenate([wanted[:3, 3] - pose[:3, 3], turn_between(wanted, pose)])
        if np.abs(off).max() < FOUND:
            return found
        try:
            change = arm.joint_changes(found, off)
        except JogError as error:
            raise StepError(str(error)) from error
        found = {name: q + change.get(name, 0.0) for name, q in found.items()}
        if any(abs(q - now[name]) > FAR for name, q in found.items()):
            break
    raise StepError("the arm cannot turn its tool this way from here: jog a joint first")
