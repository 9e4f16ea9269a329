"""A sheet of paper: headings, sentences, tables, boxes; as Markdown and as HTML that prints."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

_STYLE = """
body { font: 11pt/1.35 sans-serif; margin: 12mm; }
table { border-collapse: collapse; width: 100%; }
th, td { border: 1px solid #999; padding: 1mm 2mm; text-align: left; vertical-align: top; }
pre { border: 1px solid #999; padding: 2mm; }
section { page-break-after: always; }
li { list-style: "\\2610  "; }
"""
Row = Sequence[str]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under their heads."""

    head: Row
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class Text:
    """A sentence or two."""

    text: str


@dataclass(frozen=True, slots=True)
class Listing:
    """What is typed as it stands."""

    text: str


@dataclass(frozen=True, slots=True)
class Boxes:
    """Things to do, each with a box to tick."""

    things: tuple[str, ...]


Block = Table | Text | Listing | Boxes


@dataclass(frozen=True, slots=True)
class Sheet:
    """A page of the kit.

    Attributes:
        name: Of its file, without the end.
        title: Its heading.
        blocks: What is below.
    """

    name: str
    title: str
    blocks: tuple[Block, ...]


def markdown(sheet: Sheet) -> str:
    """Return a sheet as Markdown."""
    return "\n\n".join([f"# {sheet.title}", *map(_markdown, sheet.blocks)]) + "\n"


def html(title: str, sheets: Iterable[Sheet]) -> str:
    """Return sheets as one page that prints, each on paper of its own."""
    parts = [
        f"<section><h1>{escape(sheet.title)}</h1>{''.join(map(_html, sheet.blocks))}</section>"
        for sheet in sheets
    ]
    head = f"<meta charset='utf-8'><title>{escape(title)}</title><style>{_STYLE}</style>"
    return (
        f"<!doctype html>\n<html><head>{head}</head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )


def _markdown(block: Block) -> str:
    match block:
        case Table(head, rows):
            lines = [head, ["---"] * len(head), *rows]
            return "\n".join("| " + " | ".join(_cell(cell) for cell in row) + " |" for row in lines)
        case Listing(text):
            return f"```\n{text.rstrip()}\n```"
        case Boxes(things):
            return "\n".join(f"- [ ] {thing}" for thing in things)
        case Text(text):
            return text


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _html(block: Block) -> str:
    match block:
        case Table(head, rows):
            body = "".join(
                f"<tr>{''.join(f'<td>{escape(c)}</td>' for c in row)}</tr>" for row in rows
            )
            heads = "".join(f"<th>{escape(cell)}</th>" for cell in head)
            return f"<table><tr>{heads}</tr>{body}</table>"
        case Listing(text):
            return f"<pre>{escape(text.rstrip())}</pre>"
        case Boxes(things):
            return "<ul>" + "".join(f"<li>{_spoken(thing)}</li>" for thing in things) + "</ul>"
        case Text(text):
            return f"<p>{_spoken(text)}</p>"


def _spoken(text: str) -> str:
    """Return a sentence for the page; what Markdown has between backticks is typed as it stands."""
    return re.sub("`([^`]*)`", r"<code>\1</code>", escape(text))
