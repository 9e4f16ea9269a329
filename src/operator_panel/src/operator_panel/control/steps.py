"""Where a step of the hand leads: one joint, or the tool along an axis; pure.

A step is a move to a target, so the twin controller judges it as any other move.
"""

from __future__ import annotations

import math

from scara_config import Robot

from operator_panel.control.tool_jog import ToolArm
from operator_panel.view.snapshot import Snapshot

AXES = ("x", "y", "z")
SIZES = (0.1, 1.0, 10.0)
"""Lengths of a step [deg or mm]."""
ROUNDED = 0.006
"""So far a value is from what it rounds to [deg or mm]: a little more than half a digit."""


class StepError(ValueError):
    """The step cannot be taken; the text says why."""


def positions_now(robot: Robot, snapshot: Snapshot) -> dict[str, float]:
    """Return where the twin's joints are [rad] or [m].

    The position loops tell it exactly, but only while they are closed: a jog opens them. The state
    is rounded to two decimals, which is a tenth of a millimetre at the tool, and always of now. So
    what a loop said last counts while it rounds to the same.

    Raises:
        StepError: A joint is not known.
    """
    state = snapshot.state
    rounded = {}
    if state is not None and len(state.twin_position) == len(state.name):
        rounded = dict(zip(state.name, state.twin_position))
    found = {}
    for joint in robot.twin_joints:
        loop = snapshot.loops.get(joint.name)
        exact = loop.process_value if loop is not None else math.nan
        near = rounded.get(joint.name, exact / joint.scale)
        if abs(exact / joint.scale - near) <= ROUNDED:
            found[joint.name] = exact
        elif math.isfinite(near):
            found[joint.name] = near * joint.scale
        else:
            raise StepError(f"where {joint.name} is, is not known")
    return found


def joint_step(robot: Robot, now: dict[str, float], name: str, step: float) -> list[float]:
    """Return the target of MOVE_JOINTS [rad] or [m], in the order of the twin's joints.

    Args:
        robot: The joints and their limits.
        now: Where they are [rad] or [m].
        name: The joint that is moved.
        step: How far, with its sign [deg or mm].

    Raises:
        StepError: It would leave the joint's range.
    """
    joint = next(joint for joint in robot.twin_joints if joint.name == name)
    wanted = now[name] + step * joint.scale
    if not joint.lower <= wanted <= joint.upper:
        low, high = joint.lower / joint.scale, joint.upper / joint.scale
        raise StepError(
            f"{name} = {wanted / joint.scale:.2f} {joint.unit} is outside "
            f"{low:g} to {high:g} {joint.unit}"
        )
    return [wanted if name == other.name else now[other.name] for other in robot.twin_joints]


def tool_step(
    arm: ToolArm, now: dict[str, float], axis: str, step_mm: float, frame: str
) -> dict[str, float]:
    """Return the target of MOVE: x, y, z [m] in base_link.

    Args:
        arm: The joints that move the tool.
        now: Where the joints are [rad] or [m].
        axis: x, y or z.
        step_mm: How far, with its sign [mm].
        frame: Along whose axis: ``world``, ``tool`` or a user frame.

    Raises:
        JogError: The frame has been taken away meanwhile.
    """
    pose = arm.pose(now)
    place = pose[:3, 3] + arm.axes_of(frame, pose)[:, AXES.index(axis)] * step_mm * 1e-3
    return {name: float(value) for name, value in zip(AXES, place)}
