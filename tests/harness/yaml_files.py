"""Change one value of a shipped YAML file, in a copy."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from scara_config import files_in_force, locate

from harness.workspace import ROOT

REMOVED = object()
CONFIG = ROOT / "config"


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
