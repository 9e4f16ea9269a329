"""Change one value of a shipped YAML file, in a copy; find the values of what was read."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode
from scara_config import Robot, files_in_force, locate
from scara_config.readers import OPTIONAL, READERS, READERS_WITH_ROBOT, reader

from harness.workspace import ROOT

REMOVED = object()
CONFIG = ROOT / "config"


def shipped(name: str) -> Path:
    """Return where a shipped file of the article's robot is.

    For example ``robot.yaml`` or ``programs/ARTICLE.LS``.
    """
    return locate(name, CONFIG)


def loader(name: str, robot: Robot) -> Callable[[Path], Any]:
    """Return the loader of a file: a function of the folder it stands in."""
    return reader(name) if name in READERS else partial(reader(name), robot)


def loaders(robot: Robot) -> dict[str, Callable[[Path], Any]]:
    """Return the loaders of all shipped files, as the nodes use them."""
    names = sorted(READERS | READERS_WITH_ROBOT)
    there = [name for name in names if name not in OPTIONAL or locate(name, CONFIG).exists()]
    return {name: loader(name, robot) for name in there if name.endswith(".yaml")}


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
    text = source.read_text(encoding="utf-8")
    place = _place(_composed(text), path)
    if place is not None and value is not REMOVED:
        # What is there is overwritten: to read and write the whole takes a tenth of a second.
        new = text[: place[0]] + json.dumps(value, allow_nan=False) + text[place[1] :]
        (folder / source.name).write_text(new, encoding="utf-8")
        return folder
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


def changed_values(source: Path, folder: Path, values: Mapping[str, Any]) -> Path:
    """Write ``source`` with values replaced into ``folder``; return the folder.

    Args:
        source: A shipped file; its comments get lost.
        folder: Where the copy is written.
        values: By their keys, a point between each.

    Raises:
        KeyError: The file has no such key.
    """
    tree = YAML(typ="safe").load(source)
    for path, value in values.items():
        *branches, last = path.split(".")
        branch = tree
        for key in branches:
            branch = branch[key]
        if last not in branch:
            raise KeyError(f"{source.name}: {path}")
        branch[last] = value
    YAML(typ="safe").dump(tree, folder / source.name)
    return folder


def add_program(config: Path, text: str) -> None:
    """Put a program into a flat copy of the configuration, with the next free number of an RSR."""
    name = text.split()[1]
    (config / "programs" / f"{name}.LS").write_text(text, encoding="utf-8")
    names = YAML(typ="safe").load(config / "emulator.yaml")["rsr_programs"]
    changed_yaml(config / "emulator.yaml", config, ["rsr_programs"], [*names, name])


@cache
def _composed(text: str) -> Node:
    """Return the nodes of a text."""
    return YAML(typ="safe", pure=True).compose(text)


def _place(node: Node, path: list[str | int]) -> tuple[int, int] | None:
    """Return where a value begins and ends in its text; None if it does not stand on one line."""
    for key in path:
        if isinstance(node, MappingNode):
            node = next((value for name, value in node.value if name.value == key), None)
        elif isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
            node = node.value[key]
        else:
            return None
    if node is None or node.anchor or node.start_mark.line != node.end_mark.line:
        return None
    return node.start_mark.index, node.end_mark.index


def leaves(tree: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[Any, Any]]:
    """Yield the path and value of everything that is neither a mapping nor a list."""
    if not isinstance(tree, dict | list):
        yield path, tree
        return
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        yield from leaves(value, (*path, key))


def replaced(tree: Any, path: tuple[str | int, ...], value: Any) -> Any:
    """Return a copy of a tree with one value replaced."""
    copy = json.loads(json.dumps(tree))
    branch = copy
    for key in path[:-1]:
        branch = branch[key]
    branch[path[-1]] = value
    return copy
