"""The configuration under which a run was recorded, as the bag holds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scara_config import Robot, convert

from twin_experiments.config import ExperimentsFile


@dataclass(frozen=True)
class Configuration:
    """What the analysis needs, and from where it was taken, in words."""

    robot: Robot
    experiments: ExperimentsFile
    origin: str


def choose(recorded: Mapping[str, Any], robot: Robot, experiments: ExperimentsFile) -> Configuration:
    """Take robot and experiments from the recorded files; what the bag does not hold is taken as given.

    Args:
        recorded: File name, with or without ``.yaml``, to its content.
        robot: Of the configuration folder at hand.
        experiments: Of the configuration folder at hand.

    Raises:
        ConfigError: A recorded file is not understood.
    """
    held = {name: _file(recorded, name) for name in ("robot", "experiments")}
    if held["robot"] is not None:
        robot = convert(held["robot"], Robot, "robot.yaml in the bag")
    if held["experiments"] is not None:
        experiments = convert(held["experiments"], ExperimentsFile, "experiments.yaml in the bag")
        experiments.check("experiments.yaml in the bag")
    missing = [f"{name}.yaml" for name, tree in held.items() if tree is None]
    origin = f"from the bag, except {' and '.join(missing)}, which it does not hold" if missing else "from the bag"
    return Configuration(robot, experiments, "not in the bag: that of this machine" if len(missing) == len(held) else origin)


def _file(recorded: Mapping[str, Any], name: str) -> Any:
    """Return one recorded file, None if it is not there."""
    return recorded.get(f"{name}.yaml", recorded.get(name))
