"""Parse the text of a YAML file, or say in one line what is wrong with it, and where.

A configuration holds words, numbers, lists and mappings with words as keys. What YAML can hold
beside these is refused where it stands, so that whoever reads the result needs to expect no more.
"""

from __future__ import annotations

import re
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import MaxDepthExceededError
from ruamel.yaml.constructor import ConstructorError, SafeConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

DEEPEST = 40
"""Levels of lists and mappings [our]: a shipped file has seven."""
MOST_VALUES = 100_000
"""Values and keys after all aliases are followed [our]: a shipped file has 600."""
LARGEST_WHOLE = 2**63 - 1
"""Of 64 bits: what a message or a file of numbers can take."""
PLAIN = ("str", "int", "float", "bool", "null", "seq", "map")
_TAG = "tag:yaml.org,2002:"
_KEY = re.compile(r"^[\s\-?{\[]*[\"']?([A-Za-z_][\w./-]*)[\"']?\s*:(?!\S)")
_WIDE_ESCAPE = re.compile(r"\\U([0-9A-Fa-f]{8})")
_LAST_CHARACTER = 0x10FFFF


class YamlTextError(ValueError):
    """A text is no YAML that a configuration may hold; the message has one line, with its place."""


def parse(text: str) -> Any:
    r"""Return what a YAML text holds: dicts with words as keys, lists, words, numbers.

    Args:
        text: The whole file.

    Raises:
        YamlTextError: The text is not such YAML.

    Example:
        >>> parse("a: 1\nb: !!int word\n")
        Traceback (most recent call last):
        scara_config.files.yaml_text.YamlTextError: 'word' is no int (line 2, column 4, near `b`)
    """
    yaml = YAML(typ="safe", pure=True)
    yaml.Constructor = _PlainConstructor
    # Each level costs a byte of the text and some of Python's stack.
    yaml.max_depth = DEEPEST
    yaml.composer.warn_double_anchors = False  # YAML allows them: the last one counts
    try:
        return yaml.load(text)
    except MaxDepthExceededError as error:
        what = f"more than {DEEPEST} levels of lists and mappings"
        raise YamlTextError(_placed(text, what, error.problem_mark)) from error
    except MarkedYAMLError as error:
        raise YamlTextError(_placed(text, str(error.problem), error.problem_mark)) from error
    except ReaderError as error:
        place = _place(text, error.position)
        raise YamlTextError(f"character #x{ord_of(error):02x} may not be there {place}") from error
    except YAMLError as error:
        raise YamlTextError(" ".join(str(error).split())) from error
    except (ValueError, OverflowError) as error:
        # The scanner makes a character of an escape without looking at its number.
        wide = (m for m in _WIDE_ESCAPE.finditer(text) if int(m[1], 16) > _LAST_CHARACTER)
        at = next((match.start() for match in wide), 0)
        raise YamlTextError(f"no such character {_place(text, at)}") from error


def ord_of(error: ReaderError) -> int:
    """Return the number of the character that a reader has refused."""
    return error.character if isinstance(error.character, int) else ord(error.character)


class _PlainConstructor(SafeConstructor):
    """Makes words, numbers, lists and mappings of nodes, and nothing else."""

    def construct_document(self, node: Node) -> Any:
        """Make the whole, once its size is known."""
        # Before anything is made: aliases of aliases grow a few lines to more than memory holds.
        _count(node, {}, set())
        return super().construct_document(node)

    def construct_object(self, node: Node, deep: bool = False) -> Any:
        """Make one value, or refuse its node."""
        tag = str(node.tag).removeprefix(_TAG)
        for key, _ in node.value if isinstance(node, MappingNode) else ():
            # The key << of YAML, which takes over another mapping, has a tag of its own.
            if str(key.tag).removeprefix(_TAG) not in ("str", "merge"):
                shown = shortened(key.value) if isinstance(key, ScalarNode) else "a list or mapping"
                what = f"{shown} is no word for a key"
                raise ConstructorError(None, None, what, key.start_mark)
        if tag == "timestamp" and isinstance(node, ScalarNode):
            # Nobody here means a date: a word that looks like one is a word.
            node.ctag = self.resolver.resolve(ScalarNode, "word", (True, False))
            tag = "str"
        if tag not in PLAIN:
            raise ConstructorError(None, None, f"a tag {tag!r} is not allowed", node.start_mark)
        # A tag that somebody typed need not fit its word: !!int word.
        try:
            made = super().construct_object(node, deep=deep)
        except (ValueError, KeyError, OverflowError) as error:
            what = f"{shortened(node.value)} is no {tag}"
            raise ConstructorError(None, None, what, node.start_mark) from error
        halves = isinstance(made, str) and not made.isascii()
        if halves and any("\ud800" <= each <= "\udfff" for each in made):
            # A half of a pair can be written nowhere.
            what = f"{made!a} holds half a character"
            raise ConstructorError(None, None, what, node.start_mark)
        if isinstance(made, int) and abs(made) > LARGEST_WHOLE:
            what = f"{shortened(node.value)} is too large a number"
            raise ConstructorError(None, None, what, node.start_mark)
        return made


def _count(node: Node, known: dict[int, int], above: set[int]) -> int:
    """Return how many values a node has, aliases followed.

    Args:
        node: What is counted.
        known: Numbers by the id of nodes that were counted already.
        above: The ids of the nodes that hold this one.

    Raises:
        ConstructorError: They are too many, or the node holds itself.
    """
    if id(node) in above:
        raise ConstructorError(None, None, "a value holds itself", node.start_mark)
    if id(node) not in known:
        below: list[Node] = []
        if isinstance(node, MappingNode):
            below = [part for pair in node.value for part in pair]
        elif isinstance(node, SequenceNode):
            below = node.value
        number = 1 + sum(_count(part, known, above | {id(node)}) for part in below)
        if number > MOST_VALUES:
            what = f"more than {MOST_VALUES} values, all aliases followed"
            raise ConstructorError(None, None, what, node.start_mark)
        known[id(node)] = number
    return known[id(node)]


def shortened(value: Any) -> str:
    """Return a value as it is shown in a message, with a few of its characters."""
    text = ascii(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _placed(text: str, what: str, mark: Any) -> str:
    """Return what is wrong with its place; without one if the parser does not know it."""
    what = " ".join(what.split())
    return what if mark is None else f"{what} {_shown(text, mark.line, mark.column)}"


def _place(text: str, position: int) -> str:
    """Return the place of a character of a text."""
    before = text[:position]
    line = before.count("\n")
    return _shown(text, line, len(before) - before.rfind("\n") - 1)


def _shown(text: str, line: int, column: int) -> str:
    """Return a place for a person, with the nearest key at or above its line."""
    lines = text.split("\n")[: line + 1]
    keys = (match[1] for above in reversed(lines) if (match := _KEY.match(above)))
    near = next(keys, "")
    return f"(line {line + 1}, column {column + 1}{f', near `{near}`' if near else ''})"
