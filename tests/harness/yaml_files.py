"""Change one value of a shipped YAML file, in a copy."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from scara_config import files_in_force, load_robot, locate

from harness.workspace import ROOT

REMOVED = object()
CONFIG = ROOT / "config"
CONFIG_CHOICE = "SCARA_CONFIG_DIR"
"""Environment variable that names the folder with the YAML files."""

IDEAL_DELAY_MS = 20.5
"""How late the ideal plants follow; all three of them, as the controller measures it."""


def shipped(name: str) -> Path:
    """Return where a shipped file of the article's robot is.

    For example ``robot.yaml`` or ``programs/article.yaml``.
    """
    return locate(name, CONFIG)


def copy_configuration(folder: Path) -> Path:
    """Copy the configuration of the article's robot flat into ``folder``, as a run does.

    Return the folder.
    """
    for name, file in files_in_force(CONFIG).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, folder / name)
    return folder


def known_robot(folder: Path) -> Path:
    """Copy the configuration into ``folder`` as it is once the ideal robot was measured.

    Its first move is as fast as its later ones. Return the folder.
    """
    folder.mkdir(parents=True)
    copy_configuration(folder)
    file, delay = folder / "twin_controller.yaml", {"delay_ms": IDEAL_DELAY_MS}
    names = [joint.name for joint in load_robot(CONFIG).twin_joints]
    changed_yaml(file, folder, ["response", "measured"], {name: delay for name in names})
    return changed_yaml(file, folder, ["response", "first_percent"], 100.0)


def changed_yaml(source: Path, folder: Path, path: list[str | int], value: Any) -> Path:
    """Write ``source`` with one value replaced into ``folder``; return the folder.

    The value at ``path`` is removed for REMOVED.
    """
    yaml = YAML()
    tree = yaml.load(source)
    branch = tree
    for key in path[:-1]:
        branch = branch[key]
    if value is REMOVED:
        del branch[path[-1]]
    else:
        branch[path[-1]] = value
    yaml.dump(tree, folder / source.name)
    return folder
