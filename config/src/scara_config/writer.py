"""Change values of a YAML file in place.

Comments and order stay, and a reader never sees half a file.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import CommentMark, YAMLError
from ruamel.yaml.tokens import CommentToken

from scara_config.files.whole_file import write_whole
from scara_config.loader import ConfigError

Key = tuple[str, ...]


class Noted(NamedTuple):
    """A value with the comment that shall stand behind it."""

    value: Any
    note: str


DROPPED = object()
"""In the place of a value: its key goes, with the comment behind it."""


def changed_text(path: Path | str, changes: Mapping[Key, Any]) -> str:
    """Return the text of ``path`` with some values changed.

    Args:
        path: YAML file.
        changes: Key path, for example ``("joint_1", "position", "p")``, to the new value, one with
            a comment, or ``DROPPED``. Missing keys are added.

    Raises:
        ConfigError: The file cannot be read or is no YAML, or a key path leads through a value that
            is no mapping.
    """
    yaml = YAML()
    yaml.preserve_quotes = True
    # A long line, with its comment behind it, would else be broken after 80 characters.
    yaml.width = 4096
    # As the shipped files are indented.
    yaml.indent(mapping=2, sequence=4, offset=2)
    # By itself it would write nothing at all for null.
    yaml.representer.add_representer(type(None), _null)
    try:
        tree = yaml.load(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except YAMLError as error:
        raise ConfigError(f"{path}: is no valid YAML: {error}") from error
    for key, value in changes.items():
        node = tree
        for part in key[:-1]:
            node = node.setdefault(part, {})
            if not isinstance(node, dict):
                raise ConfigError(f"{path}: {'.'.join(key)}: {part} is no mapping")
        if value is DROPPED:
            _drop(node, key[-1])
        elif isinstance(value, Noted):
            node[key[-1]] = value.value
            _remark(node, key[-1], f"# {value.note}\n")
        elif isinstance(value, list) and isinstance(node.get(key[-1]), CommentedSeq):
            node[key[-1]][:] = value  # it stays on one line, or on as many as it had
        else:
            node[key[-1]] = value
    text = io.StringIO()
    yaml.dump(tree, text)
    return text.getvalue()


def _drop(node: CommentedMap, key: str) -> None:
    """Take a key out; whole lines of comment below it stay, between the same two keys."""
    if key not in node:
        return
    # A line of comment hangs at the key above it and would go with that.
    above = node.ca.items.get(key, [None] * 3)[1] or ()
    below = "".join(token.value for token in above) + _remarks(node, key).partition("\n")[2]
    keys = list(node)
    at = keys.index(key)
    del node[key]
    if not below or len(keys) == 1:
        return
    if at > 0:
        _remark(node, keys[at - 1], _remarks(node, keys[at - 1]) + below)
        return
    # Above the first key no other one has a place for it: it hangs before the next.
    token = CommentToken(below, CommentMark(0))
    node.ca.items.setdefault(keys[1], [None] * 4)[1] = [token]


def _remark(node: CommentedMap, key: str, text: str) -> None:
    """Put a comment behind a key's value; lines below the old one stay where it has but one."""
    old = node.ca.items.get(key, [None] * 3)[2]
    column = old.start_mark.column if old is not None else None
    below = "" if text.count("\n") > 1 else _remarks(node, key).partition("\n")[2]
    node.yaml_add_eol_comment(text.rstrip("\n"), key, column=column)
    # It knows one comment behind a value: the lines below are the rest of it.
    node.ca.items[key][2].value = text + below


def _remarks(node: CommentedMap, key: str) -> str:
    """Return the comment behind a key's value, with the lines of comment below it."""
    token = node.ca.items.get(key, [None] * 3)[2]
    return token.value if token is not None else ""


def _null(representer: Any, _: None) -> Any:
    """Write ``null`` in full."""
    return representer.represent_scalar("tag:yaml.org,2002:null", "null")


def replace_file(path: Path | str, text: str) -> None:
    """Put ``text`` into ``path`` atomically: written beside it, synced, then renamed over it.

    A symbolic link stays one.

    Raises:
        ConfigError: The folder or the file cannot be written; the old file is untouched then.
    """
    path = Path(path).resolve()
    try:
        if path.exists() and not os.access(
            path, os.W_OK
        ):  # a folder that can be written would let it be replaced
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        # What only its owner may read stays so.
        mode = path.stat().st_mode & 0o777 if path.exists() else 0o644
        write_whole(path, text.encode(), mode)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be written: {error.strerror}") from error


def check_new_file(path: Path, ending: str) -> None:
    """Refuse a file that cannot be a new one, before somebody works for it.

    Args:
        path: As it was given by ``--out``.
        ending: Of its name.

    Raises:
        ConfigError: It is there already, or has another ending, or its folder cannot be written.
    """
    if path.exists():
        why = "is there already"
    elif path.suffix != ending:
        why = f"a program's file ends with {ending}"
    elif not os.access(path.parent, os.W_OK | os.X_OK):
        why = f"{path.parent} is no folder that can be written"
    else:
        return
    raise ConfigError(f"{path}: {why}: name another by --out")


def write_values(path: Path | str, changes: Mapping[Key, Any]) -> None:
    """Change values of a YAML file in place; see :func:`changed_text` and :func:`replace_file`.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    replace_file(path, changed_text(path, changes))
