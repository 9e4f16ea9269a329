"""The robot as it was made, from the plant of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from scara_config import Joint, Robot
from scara_control.errors import ScrewModelError
from scara_control.kinematics.screws import ScrewModel, tool_positions

from twin_experiments.metrics.series import Array
from twin_experiments.metrics.true_positions import TrueArm
from twin_experiments.report.label.plant import PLANT, RecordedPlant, ScrewGeometry, ZeroOffset
from twin_experiments.report.record import RecordError


def true_arm(plant: RecordedPlant | None, robot: Robot) -> TrueArm | None:
    """Build the arm as it was made; None if the recording names no plant, as of a real robot.

    A plant without a geometry of its own is made as robot.yaml says, and so is a joint that its
    geometry does not name.

    Raises:
        RecordError: The geometry names a joint that robot.yaml does not have, or is no mechanism.
    """
    if plant is None:
        return None
    made = plant.geometry
    chain = ScrewModel.from_robot(robot) if made is None else _chain(made, robot)
    return TrueArm(partial(tool_positions, chain), zero_offsets(plant, robot.arm_joints))


def _chain(geometry: ScrewGeometry, robot: Robot) -> ScrewModel:
    names = [joint.name for joint in robot.joints]
    for name in geometry.screw_axes:
        if name not in names:
            raise RecordError(
                f"{PLANT}: geometry.screw_axes.{name}: is no joint of robot.yaml "
                f"({', '.join(names)})"
            )
    axes = [geometry.screw_axes.get(joint.name, joint.screw_axis) for joint in robot.arm_joints]
    try:
        return ScrewModel(np.array(axes, dtype=float).T, np.array(geometry.home_pose))
    except ScrewModelError as error:
        raise RecordError(f"{PLANT}: geometry: {error}") from error


def zero_offsets(plant: RecordedPlant, joints: Sequence[Joint]) -> Array:
    """Return by how much each joint is further than its encoder says, [rad] or [m]."""
    told = [(plant.axes.get(joint.name, ZeroOffset()), joint) for joint in joints]
    return np.array(
        [getattr(offset, f"zero_offset_{joint.unit}") * joint.scale for offset, joint in told]
    )
