"""The configuration under which a run was recorded, as the bag holds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scara_config import ConfigError, Robot, convert
from scara_config.files.yaml_text import YamlTextError, parse

from twin_experiments.config import ExperimentsFile

ROBOT, EXPERIMENTS = "robot.yaml", "experiments.yaml"


@dataclass(frozen=True)
class AnalysisSettings:
    """What the analysis needs, and from where it was taken, in words."""

    robot: Robot
    experiments: ExperimentsFile
    origin: str


def choose(
    recorded: Mapping[str, Any], robot: Robot, experiments: ExperimentsFile
) -> AnalysisSettings:
    """Take robot and experiments from the recorded files.

    What the bag does not hold is taken as given.

    Args:
        recorded: File name to its text.
        robot: Of the configuration folder at hand.
        experiments: Of the configuration folder at hand.

    Raises:
        ConfigError: A recorded file is not understood.
    """
    held = {name: recorded[name] for name in (ROBOT, EXPERIMENTS) if name in recorded}
    if ROBOT in held:
        robot = convert(_parse(held[ROBOT], ROBOT), Robot, f"{ROBOT} in the bag")
    if EXPERIMENTS in held:
        experiments = convert(
            _parse(held[EXPERIMENTS], EXPERIMENTS), ExperimentsFile, f"{EXPERIMENTS} in the bag"
        )
        experiments.check(robot, f"{EXPERIMENTS} in the bag")
    missing = [name for name in (ROBOT, EXPERIMENTS) if name not in held]
    origin = (
        f"in the bag, except {' and '.join(missing)}: of this machine" if missing else "in the bag"
    )
    return AnalysisSettings(
        robot, experiments, origin if held else "of this machine, the bag holds none"
    )


def _parse(text: Any, name: str) -> Any:
    """Parse the text of a recorded file.

    Raises:
        ConfigError: It is no YAML.
    """
    try:
        return parse(text)
    except (YamlTextError, TypeError, AttributeError) as error:
        raise ConfigError(f"{name} in the bag: is no valid YAML: {error}") from error
