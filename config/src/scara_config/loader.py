"""Load a YAML file into a typed structure, or say what is wrong.

The text names file, key, value and what is allowed.
"""

from __future__ import annotations

import copy
import functools
import os
import re
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

T = TypeVar("T")

OVERRIDE = "SCARA_CONFIG_DIR"

_AT = re.compile(r"^(?P<what>.*?)(?: - at `(?P<path>\$.*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]|\[\.\.\.\]")


class ConfigError(ValueError):
    """A configuration file is missing or wrong.

    The text names file, key, value and what is allowed.
    """


def config_directory() -> Path:
    """Return the folder ``config`` of the installed or sourced package ``scara_config``.

    ``SCARA_CONFIG_DIR`` wins if it is set.

    The variable reaches every program of a cell, so that a second cell can run on other ports.

    Raises:
        ConfigError: ROS cannot find the package.
    """
    if os.environ.get(OVERRIDE):
        return Path(os.environ[OVERRIDE])
    import rospkg

    try:
        return Path(rospkg.RosPack().get_path("scara_config"), "config").resolve()
    except rospkg.ResourceNotFound as error:
        raise ConfigError(
            "package scara_config is not on ROS_PACKAGE_PATH: source env.sh first"
        ) from error


def load(path: Path | str, kind: type[T]) -> T:
    """Read ``path`` and convert it to ``kind``.

    Args:
        path: YAML file.
        kind: A msgspec structure; its constraints are the allowed values.

    Raises:
        ConfigError: The file is missing, is no YAML, or a value does not fit ``kind``.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    try:
        tree = copy.deepcopy(_parsed(text))
    except YAMLError as error:
        raise ConfigError(f"{path}: is no valid YAML: {error}") from error
    return convert(tree, kind, str(path))


@functools.lru_cache(maxsize=64)
def _parsed(text: str) -> Any:
    """Parse YAML. The same text is parsed once: that takes up to 60 ms, a copy takes one."""
    return YAML(typ="safe").load(text)


def convert(tree: Any, kind: type[T], source: str) -> T:
    """Convert parsed YAML to ``kind``; ``source`` is named in errors.

    Raises:
        ConfigError: A value does not fit ``kind``.
    """
    try:
        return msgspec.convert(tree, kind, strict=True)
    except msgspec.ValidationError as error:
        match = _AT.match(str(error))
        what, path = (match["what"], match["path"]) if match else (str(error), None)
        path = _with_keys(tree, kind, str(error), path)
        key = (path or "$")[1:].lstrip(".") or "(top level)"
        raise ConfigError(f"{source}: {key} = {_value_at(tree, path)}: {what}") from error


def _with_keys(tree: Any, kind: type[Any], text: str, path: str | None) -> str | None:
    """Put the names of mapping keys into a msgspec path.

    It shows each of them only as ``[...]``.

    The culprit is found by converting the tree again with each single entry of the mapping.
    """
    tree = copy.deepcopy(tree)
    while path and "[...]" in path:
        head, _, rest = path.partition("[...]")
        mapping = _walk(tree, head)
        if not isinstance(mapping, dict):
            return path
        whole = dict(mapping)
        found = None
        for key, value in whole.items():
            mapping.clear()
            mapping[key] = value
            try:
                msgspec.convert(tree, kind, strict=True)
            except msgspec.ValidationError as error:
                if str(error) == text:
                    found = key
                    break
        if found is None:
            return path
        path = f"{head}.{found}{rest}"
    return path


def _value_at(tree: Any, path: str | None) -> str:
    """Return the value a msgspec path points to, shortened, for an error text."""
    try:
        value = _walk(tree, path or "$")
    except (KeyError, IndexError, TypeError, ValueError):
        return "(a value below)"
    text = repr(value) if not isinstance(value, dict) else "{" + ", ".join(map(str, value)) + "}"
    return text if len(text) <= 80 else text[:77] + "..."


def _walk(tree: Any, path: str) -> Any:
    """Return what a path like ``$.joints[2].name`` points to."""
    for key, index in _STEP.findall(path):
        tree = tree[key] if key else tree[int(index)]
    return tree
