"""The joints of robot.yaml among the axes on the wire: deg and mm there, rad and m here."""

from __future__ import annotations

import math
from collections.abc import Sequence

from scara_config.robot import Joint

from twin_controller.robot_sample import SampleError, SetpointError

SPEED_FACTOR = 1.5
"""A joint that is read faster than this times its greatest speed is a wrong answer. Our choice."""


def positions_of(
    axes: Sequence[float], joints: Sequence[Joint], tolerance: float
) -> tuple[float, ...]:
    """Return the position of each joint in SI.

    Args:
        axes: As read, in border units; a joint stands at the place of its ``axis_number``.
        joints: Of robot.yaml.
        tolerance: How far outside its range a position may be read, as a fraction of the range.

    Raises:
        SampleError: A joint is outside its range, or not finite.
    """
    positions = []
    for joint in joints:
        read = axes[joint.axis_number - 1]
        value = read * joint.scale
        margin = tolerance * (joint.upper - joint.lower)
        # NaN fails here as well: it compares as false.
        if not joint.lower - margin <= value <= joint.upper + margin:
            limits = f"[{joint.lower / joint.scale:.6g}, {joint.upper / joint.scale:.6g}]"
            raise SampleError(f"{joint.name} = {read} {joint.unit} is outside {limits}")
        positions.append(value)
    return tuple(positions)


def velocities_of(axes: Sequence[float], joints: Sequence[Joint]) -> tuple[float, ...]:
    """Return the speed of each joint in SI.

    Raises:
        SampleError: A joint is faster than it can be, or its speed is not finite.
    """
    velocities = []
    for joint in joints:
        read = axes[joint.axis_number - 1]
        value, limit = read * joint.scale, SPEED_FACTOR * joint.velocity
        if not -limit <= value <= limit:
            raise SampleError(
                f"{joint.name} moves at {read} {joint.unit}/s,"
                f" more than {SPEED_FACTOR} times its greatest speed"
            )
        velocities.append(value)
    return tuple(velocities)


def efforts_of(axes: Sequence[float], joints: Sequence[Joint]) -> tuple[float, ...]:
    """Return the effort of each joint [N m or N]; empty where a number is not finite.

    No motion hangs on it: what is doubtful of it is left out, and the reading stays.

    Args:
        axes: As read, in percent of the effort in robot.yaml.
        joints: Of robot.yaml.
    """
    efforts = [axes[joint.axis_number - 1] * 1e-2 * joint.effort for joint in joints]
    return tuple(efforts) if all(map(math.isfinite, efforts)) else ()


def axes_of(positions: Sequence[float], joints: Sequence[Joint], count: int) -> list[float]:
    """Return ``count`` axes in border units.

    Args:
        positions: Of the joints [rad or m]. Behind them may follow all axes as they were read
            [deg or mm]: one without a joint stays there; else it is 0.
        joints: Of robot.yaml.
        count: Of the controller's axes.

    Raises:
        SetpointError: Wrong count, a value not finite or outside the joint's range.
    """
    told, rest = len(positions), positions[len(joints) :]
    if told not in (len(joints), len(joints) + count):
        raise SetpointError(f"set point: {told} positions for {len(joints)} joints")
    axes = list(rest) or [0.0] * count
    for joint, position in zip(joints, positions):
        # Turning deg into rad and back may leave a limit a rounding error outside.
        inside = joint.lower - 1e-9 <= position <= joint.upper + 1e-9
        if not (math.isfinite(position) and inside):
            limits = f"[{joint.lower:.6g}, {joint.upper:.6g}]"
            raise SetpointError(f"{joint.name} = {position} {joint.si_unit} is outside {limits}")
        axes[joint.axis_number - 1] = position / joint.scale
    return axes
