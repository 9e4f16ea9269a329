"""Find everything that is wrong in a parsed YAML file, and where: key, line, and what was meant.

msgspec stops at the first fault. A person who mends a file wants all of them at once.
"""

from __future__ import annotations

import difflib
import functools
import re
import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import msgspec
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

Keys = tuple[str | int, ...]

_STEP = re.compile(r"\.?([^.\[\]]+)|\[(\d+)\]")
_AT = re.compile(r"^(?P<what>.*?)(?: - at `\$(?P<path>.*)`)?\Z", re.DOTALL)
_NEAR = 0.6  # our choice: two letters of a short word may differ
_SHOWN = 80
_UNIONS = (typing.Union, types.UnionType)
_ROWS = (list, tuple, set, frozenset)


class Fault(NamedTuple):
    """One thing that does not fit.

    Attributes:
        keys: Where it is: keys of mappings, indices of lists.
        value: What stands there.
        what: What is wrong with it and what is allowed.
        word: The key below ``keys`` that is meant, empty if it is ``keys`` itself.
        meant: What was probably meant, empty if nothing is near.
    """

    keys: Keys
    value: Any
    what: str
    word: str = ""
    meant: str = ""

    def text(self, line: int | None) -> str:
        """Return ``key = value: what (line N; did you mean `x`?)``."""
        hints = [f"line {line}"] if line is not None else []
        hints += [f"did you mean `{self.meant}`?"] if self.meant else []
        behind = f" ({'; '.join(hints)})" if hints else ""
        return f"{shown_keys(self.keys)} = {shown_value(self.value)}: {self.what}{behind}"


def nearest(word: str, known: Iterable[str]) -> str:
    """Return which of ``known`` somebody meant who wrote ``word``, empty if none is near.

    >>> nearest("emulatr", ["gateway", "emulator"]), nearest("x", ["gateway"])
    ('emulator', '')
    """
    found = difflib.get_close_matches(word, list(known), n=1, cutoff=_NEAR)
    return found[0] if found else ""


def find_faults(tree: Any, kind: Any) -> list[Fault]:
    """Return everything in ``tree`` that does not fit the type ``kind``; empty if it fits.

    Args:
        tree: Parsed YAML; it is not changed.
        kind: What msgspec converts to.
    """
    return list(_faults(tree, kind, ()))


def shown_keys(keys: Keys) -> str:
    """Return keys as a person writes them.

    >>> shown_keys(("joints", 2, "name")), shown_keys(())
    ('joints[2].name', '(top level)')
    """
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return text.lstrip(".") or "(top level)"


def shown_value(value: Any) -> str:
    """Return a value, shortened; of a mapping only its keys."""
    text = repr(value) if not isinstance(value, dict) else "{" + ", ".join(map(str, value)) + "}"
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def keys_of(text: str) -> Keys:
    """Read keys as :func:`shown_keys` writes them.

    >>> keys_of("joints[2].name")
    ('joints', 2, 'name')
    """
    return tuple(key or int(index) for key, index in _STEP.findall(text))


def line_of(text: str, keys: Keys) -> int | None:
    """Return the line of a YAML text at which ``keys`` stand, counted from 1.

    None: there are no such keys. For an empty ``keys`` this is the first line with content, or 1.
    """
    try:
        node = YAML(typ="safe", pure=True).compose(text)
    except YAMLError:
        return None
    # Marks count lines from 0, people from 1.
    line = node.start_mark.line + 1 if node is not None else 1
    for key in keys:
        found = _child(node, key)
        if found is None:
            return None
        node, line = found
    return line


def _child(node: Node | None, key: str | int) -> tuple[Node, int] | None:
    """Return what stands below a node under a key or index, and its line."""
    if isinstance(node, MappingNode):
        for name, value in node.value:
            if name.value == str(key):
                return value, name.start_mark.line + 1
    if isinstance(node, SequenceNode) and isinstance(key, str):
        # An entry of a list may be called by its name.
        for value in node.value:
            named = _child(value, "name")
            if named is not None and named[0].value == key:
                return value, value.start_mark.line + 1
    if isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
        value = node.value[key]
        return value, value.start_mark.line + 1
    return None


def _faults(value: Any, kind: Any, keys: Keys) -> Iterator[Fault]:
    """Yield what is wrong below, else what is wrong with the whole."""
    # Parts first: a whole that does not fit mostly has a part that does not, and that has a place.
    found = list(_below(value, kind, keys))
    if found:
        yield from found
        return
    try:
        msgspec.convert(value, kind, strict=True)
    except msgspec.ValidationError as error:
        match = _AT.match(str(error))
        what, path = (match["what"], match["path"] or "") if match else (str(error), "")
        # A path of a mapping's unnamed key cannot be followed: the whole mapping is named then.
        inner = () if "[...]" in path else keys_of(path)
        there = functools.reduce(_part, inner, value)
        choices = [str(choice) for choice in typing.get_args(_bare(kind))]
        meant = nearest(value, choices) if isinstance(value, str) else ""
        if choices and typing.get_origin(_bare(kind)) is typing.Literal:
            what = f"{what}, allowed are {', '.join(choices)}"
        yield Fault((*keys, *inner), there, what, meant=meant)


def _part(value: Any, key: str | int) -> Any:
    """Return what stands under a key; None if nothing does."""
    try:
        return value[key]
    except (LookupError, TypeError):
        return None


def _below(value: Any, kind: Any, keys: Keys) -> Iterator[Fault]:
    """Yield what is wrong with the parts of a mapping or list."""
    kind = _member(value, _bare(kind))
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in _UNIONS or origin is typing.Literal:
        return  # nobody knows which of them was meant: what is wrong is wrong with the whole
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct) and isinstance(value, dict):
        yield from _of_struct(value, kind, keys)
    elif origin is not None and isinstance(value, dict) and len(arguments) == 2:
        for key, part in value.items():
            yield from _faults(part, arguments[1], (*keys, key))
    elif origin is tuple and isinstance(value, list) and arguments[-1] is not Ellipsis:
        # Of another length it is wrong as a whole: nobody knows which of its parts is missing.
        if len(value) == len(arguments):
            for number, (part, each) in enumerate(zip(value, arguments, strict=True)):
                yield from _faults(part, each, (*keys, number))
    elif origin in _ROWS and isinstance(value, list) and arguments:
        for number, part in enumerate(value):
            yield from _faults(part, arguments[0], (*keys, number))


def _of_struct(value: dict[str, Any], kind: Any, keys: Keys) -> Iterator[Fault]:
    """Yield what is wrong with the fields of a structure: unknown, missing, or their values."""
    config = kind.__struct_config__
    fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
    absent = [name for name, field in fields.items() if field.required and name not in value]
    for key, part in value.items():
        if key in fields:
            yield from _faults(part, fields[key].type, (*keys, key))
        elif config.forbid_unknown_fields and key != config.tag_field:
            # Who mistypes a key that must be there leaves it out as well: one fault, not two.
            meant = nearest(str(key), absent) or nearest(str(key), set(fields) - set(value))
            absent = [name for name in absent if name != meant]
            what = f"Object contains unknown field `{key}`"
            yield Fault(keys, value, what, word=str(key), meant=meant)
    for name in absent:
        yield Fault(keys, value, f"Object missing required field `{name}`")


def _bare(kind: Any) -> Any:
    """Return a type without the constraints of ``Annotated``."""
    return typing.get_args(kind)[0] if typing.get_origin(kind) is typing.Annotated else kind


def _member(value: Any, kind: Any) -> Any:
    """Return the member of a union that ``value`` was meant for; another type as it is."""
    if typing.get_origin(kind) not in _UNIONS:
        return kind
    members = [_bare(member) for member in typing.get_args(kind)]
    if isinstance(value, Mapping):
        structs = [m for m in members if isinstance(m, type) and issubclass(m, msgspec.Struct)]
        for member in structs:
            config = member.__struct_config__
            # Without a tag it is the only structure of its union: msgspec takes no second one.
            if config.tag_field is None or value.get(config.tag_field) == config.tag:
                return member
    wanted = (dict,) if isinstance(value, dict) else (list, tuple, set, frozenset)
    if not isinstance(value, dict | list):
        return kind
    return next((m for m in members if typing.get_origin(m) in wanted), kind)
