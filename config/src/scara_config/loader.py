"""Load a YAML file into a typed structure, or say what is wrong.

The text names file, key, value and what is allowed.
"""

from __future__ import annotations

import copy
import functools
import os
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from scara_config.faults import Fault, find_faults, line_of

T = TypeVar("T")

OVERRIDE = "SCARA_CONFIG_DIR"


class ConfigError(ValueError):
    """A configuration file is missing or wrong.

    The text names file, key, value and what is allowed.
    """


def config_directory() -> Path:
    """Return the folder of the installed or sourced package ``scara_config``.

    ``SCARA_CONFIG_DIR`` wins if it is set.

    The variable reaches every program of a cell, so that a second cell can run on other ports.

    Raises:
        ConfigError: ROS cannot find the package.
    """
    if os.environ.get(OVERRIDE):
        return Path(os.environ[OVERRIDE])
    import rospkg

    try:
        return Path(rospkg.RosPack().get_path("scara_config"))
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
        raise ConfigError(f"{path}: is no valid YAML: {_syntax(error)}") from error
    return convert(tree, kind, str(path), text)


def _syntax(error: YAMLError) -> str:
    """Say on one line what is wrong with a YAML text, and where."""
    if not isinstance(error, MarkedYAMLError) or error.problem_mark is None:
        return " ".join(str(error).split())
    mark = error.problem_mark
    return f"{error.problem} (line {mark.line + 1}, column {mark.column + 1})"


@functools.lru_cache(maxsize=64)
def _parsed(text: str) -> Any:
    """Parse YAML. The same text is parsed once: that takes up to 60 ms, a copy takes one."""
    return YAML(typ="safe").load(text)


def convert(tree: Any, kind: type[T], source: str, text: str = "") -> T:
    """Convert parsed YAML to ``kind``.

    Args:
        tree: Parsed YAML.
        kind: A msgspec structure; its constraints are the allowed values.
        source: Named in errors.
        text: What ``tree`` was parsed from, for the lines in errors; empty: they name no line.

    Raises:
        ConfigError: A value does not fit ``kind``. The text has one line for each that does not.
    """
    try:
        return msgspec.convert(tree, kind, strict=True)
    except msgspec.ValidationError as error:
        faults = find_faults(tree, kind)
        lines = [f"{source}: {fault.text(_line(text, fault))}" for fault in faults]
        raise ConfigError("\n".join(lines) or f"{source}: {error}") from error


def _line(text: str, fault: Fault) -> int | None:
    """Return the line of a fault in its file; None without a text."""
    if not text:
        return None
    return line_of(text, (*fault.keys, fault.word) if fault.word else fault.keys)
