"""No file of the configuration, however broken, ends a program with more than one sentence.

Each row of the table is one way in which a file can be bad. It is tried on files that are shipped,
through the loader that the nodes use: one line with file, line and key.
"""

from __future__ import annotations

import ctypes
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest
from harness.running.thorough import SEARCH
from harness.workspace import ROOT
from harness.yaml_files import copy_configuration, loader, loaders
from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from scara_config import ConfigError, load_robot
from scara_config.files.yaml_text import PLAIN

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)
DEEP = 500
CAPABILITY_VERSION_3 = 0x20080522


LOADERS = loaders(ROBOT)
LOADERS["plants/ideal.yaml"] = loader("emulator.yaml", ROBOT)
LOADERS["settings/ready.yaml"] = loader("emulator.yaml", ROBOT)


class Bad(NamedTuple):
    """A broken file.

    Attributes:
        content: Of the file.
        line: What the sentence has to name; 0: there is no line.
        key: What the sentence has to name.
    """

    content: bytes
    line: int
    key: str = ""


class Place(NamedTuple):
    """A number in a file: its text's begin and end, its line and its key."""

    begin: int
    end: int
    line: int
    key: str


def numbers(node: Node, key: str = "") -> Iterator[Place]:
    """Yield every number of a file."""
    if isinstance(node, MappingNode):
        for name, value in node.value:
            yield from numbers(value, str(name.value))
    elif isinstance(node, SequenceNode):
        for value in node.value:
            yield from numbers(value, key)
    elif isinstance(node, ScalarNode) and str(node.tag).endswith((":int", ":float")):
        begin, end = node.start_mark, node.end_mark
        yield Place(begin.index, end.index, begin.line + 1, key)


def whole(content: str | bytes, line: int = 1) -> Callable[[str], Bad]:
    """Replace the whole file."""
    raw = content.encode() if isinstance(content, str) else content
    return lambda text: Bad(raw, line)


def value(snippet: str) -> Callable[[str], Bad]:
    """Replace the first number of the file; where there is none, add a key."""

    def change(text: str) -> Bad:
        place = next(numbers(YAML().compose(text)), None)
        if place is None:
            return added(f"bad: {snippet}\n")(text)
        return Bad(
            (text[: place.begin] + snippet + text[place.end :]).encode(), place.line, place.key
        )

    return change


def added(snippet: str, line: int = 0, key: str = "bad") -> Callable[[str], Bad]:
    """Add lines to the end of the file."""

    def change(text: str) -> Bad:
        text = text.rstrip("\n") + "\n"
        return Bad((text + snippet).encode(), text.count("\n") + 1 + line, key)

    return change


def in_other_coding(coding: str) -> Callable[[str], Bad]:
    """Save the file in another coding than UTF-8."""
    return lambda text: Bad(("# Gerät\n" + text).encode(coding, "replace"), 1)


def without_first_key(text: str) -> Bad:
    """Leave a key of the top level out."""
    lines = text.split("\n")
    tops = [n for n, line in enumerate(lines) if re.match(r"\w+:", line)]
    first, *others = [n for n in tops if not lines[n].startswith("base_")]
    end = next(iter(others), len(lines))
    key = lines[first].partition(":")[0]
    return Bad("\n".join([*lines[:first], *lines[end:]]).encode(), 0, key)


def first_key_twice(text: str) -> Bad:
    """Give a key of the top level a second time, at the end."""
    key = re.findall(r"^(\w+):", text, re.MULTILINE)[0]
    return added(f"{key}: 1\n", key=key)(text)


TABLE: dict[str, Callable[[str], Bad]] = {
    # what is no mapping
    "empty": whole(""),
    "a comment only": whole("# nothing\n"),
    "null": whole("~\n"),
    "a list": whole("- 1\n- 2\n"),
    "a word": whole("word\n"),
    "a number": whole("7\n"),
    "no content": whole("---\n", 2),
    "an end only": whole("...\n"),
    # what is no text
    "binary": whole(bytes(range(128, 256))),
    "Latin-1": in_other_coding("latin-1"),
    "UTF-16": in_other_coding("utf-16"),
    "a zero byte": value("1\x00"),
    "a control character": value("1\x07"),
    "half a character": value(r'"\ud800"'),
    "no such character": value(r'"\Uffffffff"'),
    "an unknown escape": value(r'"\q"'),
    # what is no YAML
    "a tab": added("bad:\n\t- 1\n", 1),
    "an open bracket": added("bad: [1, 2\n", 1),
    "an open quote": added('bad: "word\n', 1),
    "two colons": added("bad: 1: 2\n"),
    "an indented key": added("bad: 1\n  worse: 2\n", 1, "worse"),
    "two documents": added("---\nbad: 1\n", key=""),
    "another YAML": whole("%YAML 3.0\n---\na: 1\n"),
    "an at sign": value("@5"),
    "a per cent sign": value("%5"),
    # keys
    "a key twice": first_key_twice,
    "an unknown key": added("bad: 1\n"),
    "a missing key": without_first_key,
    "a number as key": added("7: 1\n", key=""),
    "null as key": added("~: 1\n", key=""),
    "a list as key": added("? [a, b]\n: 1\n", key=""),
    "a mapping as key": added("? {a: b}\n: 1\n", key=""),
    # aliases and merges
    "an unknown alias": value("*nowhere"),
    "a value that holds itself": added("bad: &bad [*bad]\n"),
    "a merge of a number": added("bad: 1\n<<: 3\n", 1),
    "a merge of numbers": added("bad: 1\n<<: [1, 2]\n", 1),
    "a merge of nothing": added("bad: 1\n<<: *nowhere\n", 1),
    "aliases without end": added(
        "bad: &a [x, x, x, x, x, x, x, x, x, x]\n"
        + "".join(
            f"{c}: &{c} [{', '.join(['*' + below] * 10)}]\n"
            for below, c in zip("abcdefg", "bcdefgh")
        ),
        4,
        "",
    ),
    # depth and size
    "many lists": added(f"bad: {'[' * DEEP}{']' * DEEP}\n"),
    "many open lists": added(f"bad: {'[' * DEEP}\n"),
    "many mappings": added(f"bad: {'{a: ' * DEEP}1{'}' * DEEP}\n"),
    "many levels": added("bad:\n" + "".join(f"{' ' * n}a:\n" for n in range(1, 200)), 39, "a"),
    "a megabyte": whole("a: " + "x" * 1_000_000, 0),
    # tags
    "a program": value("!!python/object/apply:os.system [true]"),
    "a tag of nobody": value("!nobody 1"),
    "a tag without end": value("!<nobody 1"),
    "a set": value("!!set {a, b}"),
    "a word for a number": value("!!int word"),
    "a word for a truth": value("!!bool word"),
    "bytes": value("!!binary '%%%'"),
    # values
    "no number": value(".nan"),
    "infinity": value(".inf"),
    "minus infinity": value("-.inf"),
    "a huge number": value("1.0e+400"),
    "a number of 400 digits": value("9" * 400),
    "a number of 5000 digits": value("9" * 5000),
    "a hexadecimal number of 5000 digits": value("0x" + "f" * 5000),
    "a number in quotes": value('"1"'),
    "a date": value("2020-01-01"),
    "no date": value("2020-13-45"),
    "a time": value("2020-01-01T99:00:00"),
    "a list in a number's place": value("[1]"),
    "a mapping in a number's place": value("{a: 1}"),
    "a truth in a number's place": value("true"),
    "no value": value("null"),
    "a unit behind the number": value("5 mm"),
    "another decimal point": value("0,5"),
}
"""What is wrong -> how a shipped text is made so."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a copy of the configuration in which one file at a time is wrong."""
    return copy_configuration(tmp_path_factory.mktemp("config"))


def said(name: str, folder: Path) -> str:
    """Return a loader's error; empty if it loads. Another error than ConfigError comes out."""
    try:
        LOADERS[name](folder)
    except ConfigError as error:
        return str(error)
    return ""


def some(number: int) -> list[str]:
    """Return the files that a row of the table is tried on: all by night, each fourth by turns."""
    return list(LOADERS) if SEARCH else list(LOADERS)[number % 4 :: 4]


def lacking(sentence: str, file: Path, bad: Bad) -> list[str]:
    """Return what a sentence does not have."""
    lines = sentence.split("\n")
    wanted = {
        "one line": len(lines) == 1,
        "the file": str(file) in sentence,
        "the line": not bad.line or f"line {bad.line}" in sentence,
        "the key": bad.key in sentence,
        "a length to read": len(sentence) - len(str(file)) < 400,
        "characters to print": sentence.isprintable(),
    }
    return [what for what, is_there in wanted.items() if not is_there]


def test_the_table_has_all_kinds() -> None:
    """At least 45 ways, and no tag but the plain ones."""
    assert len(TABLE) >= 45 and len(PLAIN) == 7


@pytest.mark.parametrize(("number", "kind"), [*enumerate(TABLE)])
def test_a_bad_file_gives_one_sentence_with_file_line_and_key(
    number: int, kind: str, bench: Path
) -> None:
    """Never a traceback."""
    offenders = []
    for name in some(number):
        file = bench / name
        shipped = file.read_text(encoding="utf-8")
        bad = TABLE[kind](shipped)
        file.write_bytes(bad.content)
        try:
            sentence = said(name, bench)
        except Exception as error:
            sentence = f"TRACEBACK {type(error).__name__}: {error}"
        finally:
            file.write_text(shipped, encoding="utf-8")
        if missing := lacking(sentence, file, bad):
            offenders.append(f"{name} lacks {missing}: {sentence or 'loads'}")
    assert offenders == []


@pytest.mark.parametrize("kind", ["a folder", "a link to itself", "a pipe", "nothing"])
def test_what_is_no_file_gives_one_sentence(kind: str, bench: Path) -> None:
    """A pipe would be waited for without end."""
    offenders = []
    for name in LOADERS:
        file = bench / name
        shipped = file.read_text(encoding="utf-8")
        file.unlink()
        if kind == "a folder":
            file.mkdir()
        elif kind == "a link to itself":
            file.symlink_to(file)
        elif kind == "a pipe":
            os.mkfifo(file)
        sentence = said(name, bench)
        if kind == "a folder":
            file.rmdir()
        else:
            file.unlink(missing_ok=True)
        file.write_text(shipped, encoding="utf-8")
        if lacking(
            sentence, bench if name.startswith(("plants/", "settings/")) else file, Bad(b"", 0)
        ):
            offenders.append(f"{name}: {sentence or 'loads'}")
    assert offenders == []


def test_what_may_not_be_read_gives_one_sentence(bench: Path) -> None:
    """The reason is the system's."""
    file = bench / "motion.yaml"
    file.chmod(0)
    try:
        with without_rights():
            sentence = said("motion.yaml", bench)
    finally:
        file.chmod(0o644)
    assert "motion.yaml: cannot be read: Permission denied" in sentence


@contextmanager
def without_rights() -> Iterator[None]:
    """Take from this thread what lets root read a file whatever its mode says."""
    system = ctypes.CDLL(None)
    header = (ctypes.c_uint32 * 2)(CAPABILITY_VERSION_3, 0)
    kept = (ctypes.c_uint32 * 6)()  # twice effective, permitted, inheritable
    assert system.capget(header, kept) == 0
    none_effective = type(kept)(0, *kept[1:3], 0, *kept[4:6])
    assert system.capset(header, none_effective) == 0
    try:
        yield
    finally:
        assert system.capset(header, kept) == 0
