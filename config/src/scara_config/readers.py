"""Read every configuration file of a cell as its nodes will, before any of them is started.

``READERS`` says who reads which file. The readers are imported by name: the rooms stand above this
one, and who only wants one file needs none of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from scara_config.faults import keys_of, line_of
from scara_config.loader import ConfigError, config_directory
from scara_config.profile import PLANTS, locate
from scara_config.robot import Robot, load_robot

READERS: dict[str, str] = {
    "bringup.yaml": "scara_bringup.config:load_bringup",
    "camera.yaml": "scara_simulation.camera.config:load_camera",
    "comparison.yaml": "twin_analysis.compare.config:load_comparison",
    "farm/farm.yaml": "farm.config:load_farm",
    "frames.yaml": "scara_config.frames:load_frames",
    "gateway.yaml": "rosbridge_gateway.config:load_gateway_config",
    "farm/journal.yaml": "cell_recorder.config:load_journal",
    "modbus_map.yaml": "scara_config.modbus_map:load_modbus_map",
    "motion.yaml": "scara_control.config:load_motion",
    "operator_panel.yaml": "operator_panel.config:load_panel",
    "palletise.yaml": "scara_config.palletise:load_palletise",
    "payloads.yaml": "scara_config.payload:load_payloads",
    "pendant_page.yaml": "fanuc_emulator.config:load_pendant_page",
    "persons.yaml": "scara_ros.page.persons_io:load_persons",
    "robot.yaml": "scara_config.robot:load_robot",
    "what_if.yaml": "what_if.config:load_what_if",
}
"""File -> ``module:function`` of the folder."""

READERS_WITH_ROBOT: dict[str, str] = {
    "body.yaml": "scara_description.body:load_body",
    "emulator.yaml": "fanuc_emulator.config:load_emulator",
    "experiments.yaml": "twin_experiments.config:load_experiments",
    "pid_gains.yaml": "scara_simulation.config:load_gains",
    "programs": "fanuc_emulator.config:load_programs",
    "simulation.yaml": "scara_simulation.config:load_simulation",
    "twin_controller.yaml": "twin_controller.config:load_twin_controller",
}
"""File or folder -> ``module:function`` of (robot, folder); emulator.yaml brings its plant."""

OPTIONAL = frozenset({"body.yaml", "frames.yaml", "palletise.yaml"})
"""Not every robot has them."""

NEEDS_ROBOT = "has faults, so what depends on it was not checked: "
"""So goes on what is said in place of the faults of ``READERS_WITH_ROBOT``."""


def reader(name: str) -> Callable[..., Any]:
    """Return the function that reads a file.

    Raises:
        KeyError: Nobody reads a file of this name.
    """
    module, _, function = (READERS | READERS_WITH_ROBOT)[name].partition(":")
    found: Callable[..., Any] = getattr(import_module(module), function)
    return found


def check_files(directory: Path | str | None = None, robot: Robot | None = None) -> list[str]:
    """Read all files of the chosen robot's cell and return every fault, one line each.

    A line holds file, key, value, what is allowed, and where it can be told the line number and
    what was probably meant. Files that fit ``robot.yaml`` are read only if that has no fault.

    Args:
        directory: Folder with all YAML files; default: the package scara_config.
        robot: What the files that fit it are read with; default: robot.yaml, without a fault.

    Raises:
        ConfigError: There is no such robot.
    """
    folder = Path(directory or config_directory())
    found: list[str] = []
    for name in READERS:
        found += _faults_of(name, folder)
    try:
        robot = robot or load_robot(folder)
    except ConfigError:
        waiting = ", ".join(READERS_WITH_ROBOT)
        return [*dict.fromkeys(found), f"{locate('robot.yaml', folder)}: {NEEDS_ROBOT}{waiting}"]
    for name in READERS_WITH_ROBOT:
        found += _faults_of(name, folder, robot)
    # A plant that is not chosen today is read tomorrow.
    for plant in sorted(locate(PLANTS, folder).glob("*.yaml")):
        found += _faults_of("emulator.yaml", folder, robot, plant.stem)
    # emulator.yaml is read once with each plant, and tells its own faults each time.
    return list(dict.fromkeys(found))


def _faults_of(
    name: str, folder: Path, robot: Robot | None = None, plant: str | None = None
) -> Iterator[str]:
    """Yield the faults of one file; of emulator.yaml with a plant."""
    if name in OPTIONAL and not locate(name, folder).exists():
        return
    try:
        reader(name)(*([robot] if robot else []), folder, *([plant] if plant else []))
    except ConfigError as error:
        yield from (with_line(line) for line in str(error).splitlines())


def with_line(fault: str) -> str:
    """Add the line number to a fault that names file and key but no line.

    A file's own rules, such as limits the wrong way round, are judged after it was read. They know
    keys but no lines.
    """
    file, _, rest = fault.partition(": ")
    key = rest.partition(" = ")[0].partition(": ")[0]
    if "(line " in fault or ", line " in file or not file.endswith(".yaml"):
        return fault
    try:
        line = line_of(Path(file).read_text(encoding="utf-8"), keys_of(key))
    except OSError:
        return fault
    return f"{fault} (line {line})" if line is not None and keys_of(key) else fault
