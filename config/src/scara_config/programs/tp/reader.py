"""Read the text of a program, ``NAME.LS``."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from scara_config.loader import ConfigError
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import (
    Coordinate,
    GroupPosition,
    Line,
    Position,
    Program,
    Unknown,
)

_NUMBER = re.compile(r"^\s*\d*\s*:")
_HEAD = re.compile(r'P\[(\d+)(?::\s*"?([^"\]]*)"?)?\]\s*\{')
_GROUP = re.compile(r"GP(\d+):")
_FRAMES = re.compile(r"UF\s*:\s*(\w+)\s*,\s*UT\s*:\s*(\w+)\s*,?\s*(?:CONFIG\s*:\s*'([^']*)'\s*,?)?")
_COORDINATE = re.compile(r"([XYZWPR]|[JE]\d)\s*=\s*(-?\d*\.?\d+|\*+)\s*(mm|deg)\s*,?")
_ATTRIBUTE = re.compile(r"""((?:"[^"]*"|.)*?)(?:;|,(?=\s*[A-Z_]+\s*=)|\Z)""")
_SECTION = re.compile(r"/(PROG|ATTR|APPL|MN|POS|END)\b(.*)")

Rows = Sequence[tuple[int, str]]
"""Lines of a file with their numbers, from 1."""


def read(text: str, source: str, errors: list[str] | None = None) -> Program:
    """Read a program.

    Args:
        text: Of the whole file.
        source: Names the file, for errors.
        errors: Gets a text for each line that is not understood, which becomes ``Unknown``; None:
            the first one is raised.

    Raises:
        ConfigError: The file is no program, or a line of it is not understood: the text names
            the file, its line and that of the program.
    """
    sections = _sections(text, source)
    head = sections["PROG"][0][1].split()
    if not head:
        raise ConfigError(f"{source}, line {sections['PROG'][0][0]}: /PROG names no program")
    return Program(
        name=head[0],
        kind=" ".join(head[1:]),
        attributes=_attributes(sections.get("ATTR", [])),
        application=tuple(row.rstrip() for _, row in sections.get("APPL", []) if row.strip()),
        lines=tuple(_lines(sections["MN"], source, errors)),
        positions=tuple(_positions(sections.get("POS", []), source)),
    )


def _sections(text: str, source: str) -> dict[str, list[tuple[int, str]]]:
    """Return the rows below each heading; that of PROG is what stands behind the word."""
    found: dict[str, list[tuple[int, str]]] = {}
    here: list[tuple[int, str]] | None = None
    for number, row in enumerate(text.splitlines(), start=1):
        heading = _SECTION.match(row)
        if heading is None:
            if here is not None:
                here.append((number, row))
            continue
        here = found.setdefault(heading[1], [])
        if heading[1] == "PROG":
            here.append((number, heading[2]))
        if heading[1] == "END":
            break
    for wanted in ("PROG", "MN"):
        if wanted not in found:
            raise ConfigError(f"{source}: is no program of a teach pendant: /{wanted} is missing")
    return found


def _attributes(rows: Rows) -> dict[str, str]:
    """Return the attributes, those within TCD beside the others."""
    # TCD: begins the attributes of the task, which are kept beside all others.
    text = " ".join(row.strip() for _, row in rows).replace("TCD:", "")
    found = {}
    # A comma ends an attribute of TCD only; elsewhere it belongs to the value: 1,*,*,*,*. Within
    # quotes neither it nor a semicolon ends anything.
    for part in _ATTRIBUTE.finditer(text):
        name, equals, value = part[1].partition("=")
        if equals:
            found[name.strip()] = value.strip()
    return found


def _lines(rows: Rows, source: str, errors: list[str] | None) -> Iterator[Line]:
    """Yield the program's lines; one ends with a semicolon and may go over several rows."""
    begin, text, count = 0, "", 0
    for number, row in rows:
        if not row.strip():
            continue
        if not text:
            begin = number
        # A row that goes on with a line begins with a colon and no number.
        text += " " + _NUMBER.sub("", row, count=1).strip()
        if not text.endswith(";"):
            continue
        count += 1
        try:
            yield read_line(text.strip()[:-1])
        except ConfigError as error:
            said = f"{source}, line {begin}: line {count} of the program: {text.strip()!r}: {error}"
            if errors is None:
                raise ConfigError(said) from error
            errors.append(said)
            yield Unknown(text.strip()[:-1].strip())
        text = ""
    if text:
        raise ConfigError(f"{source}, line {begin}: {text.strip()!r}: has no semicolon at its end")


def _positions(rows: Rows, source: str) -> Iterator[Position]:
    """Yield the positions of /POS."""
    text = ""
    begin = 0
    for number, row in rows:
        begin = begin or number
        text += row + "\n"
        if row.strip() != "};":
            continue
        try:
            yield _position(text.strip())
        except ConfigError as error:
            raise ConfigError(f"{source}, line {begin}: {error}") from error
        text, begin = "", 0
    if text.strip():
        raise ConfigError(f"{source}, line {begin}: {text.strip()[:40]!r}: is no position")


def _position(text: str) -> Position:
    head = _HEAD.match(text)
    if head is None:
        raise ConfigError(f"{text[:40]!r}: is no position")
    body = text[head.end() : -len("};")]
    parts = _GROUP.split(body)
    if parts[0].strip() or len(parts) < 3:
        raise ConfigError(f"P[{head[1]}]: GP1: is expected at {parts[0].strip()[:40]!r}")
    groups = tuple(
        _group(int(number), part.strip(), f"P[{head[1]}], GP{number}")
        for number, part in zip(parts[1::2], parts[2::2])
    )
    return Position(int(head[1]), head[2] or "", groups)


def _group(number: int, text: str, place: str) -> GroupPosition:
    frames = _FRAMES.match(text)
    if frames is None:
        raise ConfigError(f"{place}: UF and UT are expected at {text[:40]!r}")
    coordinates = []
    at = frames.end()
    while found := _COORDINATE.match(text, len(text) - len(text[at:].lstrip())):
        value = None if found[2].startswith("*") else float(found[2])
        coordinates.append(Coordinate(found[1], value, found[3]))
        at = found.end()
    if text[at:].strip():
        raise ConfigError(f"{place}: {text[at:].strip()[:40]!r} is no coordinate")
    return GroupPosition(number, frames[1], frames[2], frames[3] or "", tuple(coordinates))
