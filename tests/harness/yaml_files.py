"""Change one value of a shipped YAML file, in a copy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

REMOVED = object()


def changed_yaml(source: Path, folder: Path, path: list[str | int], value: Any) -> Path:
    """Write ``source`` with the value at ``path`` replaced (or removed, for REMOVED) into ``folder``; return the folder."""
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
