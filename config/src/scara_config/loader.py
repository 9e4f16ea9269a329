"""Load a YAML file into a typed structure, or say what is wrong.

The text names file, key, value and what is allowed.
"""

from __future__ import annotations

import copy
import functools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from scara_config.faults import find_faults, line_of
from scara_config.files.yaml_text import YamlTextError, parse

T = TypeVar("T")

OVERRIDE = "SCARA_CONFIG_DIR"
LARGEST = 1_000_000
"""Bytes of a file [our]: the largest that is shipped has 20,000."""


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of all sections of a file: unknown keys are errors."""


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
    return package_folder("scara_config")


def package_folder(name: str) -> Path:
    """Return the folder of an installed or sourced package.

    Raises:
        ConfigError: ROS cannot find it.
    """
    # Loaded late: where SCARA_CONFIG_DIR names the folder, no ROS has to be there.
    import rospkg

    try:
        # Handed over, so that packages are searched anew once the variable has changed.
        return Path(_packages(os.environ.get("ROS_PACKAGE_PATH", "")).get_path(name))
    except rospkg.ResourceNotFound as error:
        raise ConfigError(
            f"package {name} is not on ROS_PACKAGE_PATH: source env.sh first"
        ) from error


@functools.lru_cache(maxsize=1)
def _packages(_paths: str) -> Any:
    """Return what knows the packages: it walks through all folders once, which takes 16 ms."""
    import rospkg

    return rospkg.RosPack()


def load(path: Path | str, kind: type[T], complete: Callable[[Any], Any] = lambda tree: tree) -> T:
    """Read ``path`` and convert it to ``kind``.

    Args:
        path: YAML file.
        kind: A msgspec structure; its constraints are the allowed values.
        complete: Puts what follows from the rest of the parsed file into it.

    Raises:
        ConfigError: The file cannot be read, is no YAML, or a value does not fit ``kind``.
    """
    path = Path(path)
    text = load_text(path)
    try:
        # A copy: complete changes it, and what is kept belongs to everybody who reads the file.
        tree = complete(copy.deepcopy(_parsed(text)))
    except YamlTextError as error:
        raise ConfigError(f"{path}: is no valid YAML: {error}") from error
    # An empty file has a line, too, which its faults can name.
    return convert(tree, kind, str(path), text or "\n")


def load_keys(path: Path | str, kinds: Mapping[str, Any]) -> list[Any]:
    """Read some values of a file; its other keys are somebody else's business.

    Args:
        path: YAML file.
        kinds: By key, ``section.name``: what its value must be.

    Returns:
        The values, in the order of ``kinds``.

    Raises:
        ConfigError: The file cannot be read, or one of these values is missing or does not fit.
    """
    tree: dict[str, Any] = {}
    for key, kind in kinds.items():
        *sections, name = key.split(".")
        place = tree
        for section in sections:
            place = place.setdefault(section, {})
        place[name] = kind

    def struct(part: Mapping[str, Any]) -> Any:
        fields = [(k, struct(v) if isinstance(v, dict) else v) for k, v in part.items()]
        return msgspec.defstruct("Keys", fields, frozen=True)

    whole = load(path, struct(tree))
    return [functools.reduce(getattr, key.split("."), whole) for key in kinds]


def load_text(path: Path) -> str:
    """Return the text of a file.

    Raises:
        ConfigError: It is missing, no file, too large, or not in UTF-8.
    """
    try:
        # A pipe in its place would keep whoever reads it waiting for ever.
        if path.exists() and not path.is_file():
            raise ConfigError(f"{path}: cannot be read: it is no file")
        content = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    if len(content) > LARGEST:
        raise ConfigError(f"{path}: {len(content)} bytes: Expected at most {LARGEST}")
    try:
        # Some editors begin a file with a byte order mark.
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        byte = content[error.start]
        raise ConfigError(
            f"{path}: is not in UTF-8: byte 0x{byte:02x} (line {line}). Save it as UTF-8"
        ) from error


@functools.lru_cache(maxsize=64)
def _parsed(text: str) -> Any:
    """Parse YAML. The same text is parsed once: that takes up to 60 ms, a copy takes one."""
    return parse(text)


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
        lines = []
        for fault in faults:
            keys = (*fault.keys, fault.word) if fault.word else fault.keys
            lines.append(f"{source}: {fault.text(line_of(text, keys) if text else None)}")
        # msgspec has refused the file, also where none of its parts shows why.
        raise ConfigError("\n".join(lines) or f"{source}: {error}") from error
