"""The configuration under which a run was recorded, as the bag holds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scara_config import ConfigError, Robot, convert
from scara_config.files.yaml_text import YamlTextError, parse
from scara_config.lengths import with_lengths

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
        tree = with_lengths(_as_now(_parse(held[ROBOT], ROBOT)))
        robot = convert(tree, Robot, f"{ROBOT} in the bag")
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


def _as_now(tree: Any) -> Any:
    """Return a parsed robot.yaml without what older ones typed and is computed now."""
    if isinstance(tree, dict):
        tree.pop("watched_points", None)
        joints = tree.get("joints")
        for joint in joints if isinstance(joints, list) else ():
            if isinstance(joint, dict):
                joint.pop("inertia", None)
    return tree


def _parse(text: Any, name: str) -> Any:
    """Parse the text of a recorded file.

    Raises:
        ConfigError: It is no YAML.
    """
    try:
        return parse(text)
    except (YamlTextError, TypeError, AttributeError) as error:
        raise ConfigError(f"{name} in the bag: is no valid YAML: {error}") from error
