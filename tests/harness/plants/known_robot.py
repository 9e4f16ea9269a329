"""A twin controller that has measured its robot: its first move is as fast as later ones."""

from __future__ import annotations

from pathlib import Path

import msgspec
from scara_config import Robot, load_robot
from twin_controller.config import MeasuredJoint, TwinControllerConfig

from harness.workspace import ROOT
from harness.yaml_files import changed_yaml, copy_configuration

IDEAL_DELAY_MS = 14.6
"""How late the ideal plants follow; all three of them, as the controller measures it."""
FASTEST_PERCENT = 100.0
"""It has kept up with any speed."""


def knowing(
    config: TwinControllerConfig, robot: Robot, delay_ms: float = IDEAL_DELAY_MS
) -> TwinControllerConfig:
    """Return a configuration that knows how late each joint of the robot is."""
    joints = {joint.name: MeasuredJoint(delay_ms) for joint in robot.twin_joints}
    response = msgspec.structs.replace(
        config.response, measured=joints, first_percent=FASTEST_PERCENT
    )
    return msgspec.structs.replace(config, response=response)


def known_robot(folder: Path) -> Path:
    """Write the article's configuration, as :func:`knowing` has it, into a new folder."""
    folder.mkdir(parents=True)
    copy_configuration(folder)
    file, delay = folder / "twin_controller.yaml", {"delay_ms": IDEAL_DELAY_MS}
    names = [joint.name for joint in load_robot(ROOT / "config").twin_joints]
    changed_yaml(file, folder, ["response", "measured"], {name: delay for name in names})
    return changed_yaml(file, folder, ["response", "first_percent"], FASTEST_PERCENT)
