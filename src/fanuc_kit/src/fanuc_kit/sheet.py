"""A sheet of paper: headings, sentences, tables, boxes; as Markdown and as HTML that prints."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

# The title is filled in by %, so each percent sign of the style itself stands twice.
_STYLE = """
@page { size: A4; margin: 20mm 14mm 16mm;
  @top-left { font: 9pt sans-serif; content: "%(title)s"; }
  @bottom-right { font: 9pt sans-serif; content: counter(page) " / " counter(pages); } }
body { font: 10.5pt/1.35 sans-serif; max-width: 182mm; margin: 0 auto; }
h1 { font-size: 15pt; margin: 0 0 3mm; } h1, p { break-after: avoid; }
section { break-after: page; } section:last-child { break-after: auto; }
table { border-collapse: collapse; width: 100%%; margin: 3mm 0; font: 8.8pt/1.25 sans-serif; }
thead { display: table-header-group; }
th, td { border: 1px solid #777; padding: 0.6mm 1.6mm; text-align: left; vertical-align: top; }
tr, li, pre { break-inside: avoid; }
pre { border: 1px solid #777; padding: 2mm; }
ul { padding: 0; } li { list-style: none; margin: 2mm 0 2mm 8mm; text-indent: -8mm; }
li::before { content: ""; display: inline-block; width: 3.6mm; height: 3.6mm;
  margin-right: 4.2mm; border: 0.3mm solid; vertical-align: -0.5mm; }
.done { display: flex; gap: 4mm; margin: 0 0 4mm; font-size: 9pt; }
.done span { flex: 1; border: 1px solid #777; padding: 1mm 2mm 7mm; }
"""
"""Of the page; with the title of all its sheets."""
_SHEET = '@page sheet%(at)d { @top-right { font: 9pt sans-serif; content: "%(said)s"; } }'
_DONE = ("robot, number", "done by", "date")
"""Boxes that a person fills in at the head of each sheet."""
Row = Sequence[str]


@dataclass(frozen=True, slots=True)
class SheetTable:
    """Rows under their heads."""

    head: Row
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class SheetText:
    """A sentence or two, or what is ``typed`` as it stands."""

    text: str
    typed: bool = False


@dataclass(frozen=True, slots=True)
class Boxes:
    """Things to do, each with a box to tick."""

    things: tuple[str, ...]


Block = SheetTable | SheetText | Boxes


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


def html(title: str, sheets: Sequence[Sheet]) -> str:
    """Return sheets as one page that prints on A4, each on paper of its own."""
    # It stands between the quotes of a rule of the style.
    style, parts = [_STYLE % {"title": re.sub(r"[^\w :,.-]", "", title)}], []
    done = "".join(f"<span>{field}</span>" for field in _DONE)
    for at, sheet in enumerate(sheets, start=1):
        style.append(_SHEET % {"at": at, "said": f"sheet {at} of {len(sheets)}"})
        parts.append(
            f'<section style="page: sheet{at}"><div class="done">{done}</div>'
            f"<h1>{escape(sheet.title)}</h1>{''.join(map(_html, sheet.blocks))}</section>"
        )
    head = f"<meta charset='utf-8'><title>{escape(title)}</title><style>{''.join(style)}</style>"
    return (
        f"<!doctype html>\n<html><head>{head}</head>\n<body>\n"
        + "\n".join(parts)
        + "\n</body></html>\n"
    )


def _markdown(block: Block) -> str:
    match block:
        case SheetTable(head, rows):
            lines = [head, ["---"] * len(head), *rows]
            # A bar would begin another cell.
            cells = [[cell.replace("|", "\\|") for cell in row] for row in lines]
            return "\n".join("| " + " | ".join(row) + " |" for row in cells)
        case SheetText(text, typed=True):
            return f"```\n{text.rstrip()}\n```"
        case Boxes(things):
            return "\n".join(f"- [ ] {thing}" for thing in things)
        case SheetText(text):
            return text


def _html(block: Block) -> str:
    match block:
        case SheetTable(head, rows):
            body = "".join(
                f"<tr>{''.join(f'<td>{escape(c)}</td>' for c in row)}</tr>" for row in rows
            )
            heads = "".join(f"<th>{escape(cell)}</th>" for cell in head)
            return f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        case SheetText(text, typed=True):
            return f"<pre>{escape(text.rstrip())}</pre>"
        case Boxes(things):
            return "<ul>" + "".join(f"<li>{_spoken(thing)}</li>" for thing in things) + "</ul>"
        case SheetText(text):
            return f"<p>{_spoken(text)}</p>"


def _spoken(text: str) -> str:
    """Return a sentence for the page; what Markdown has between backticks is typed as it stands."""
    # Escaped first, so that the tags made here are the only ones.
    return re.sub("`([^`]*)`", r"<code>\1</code>", escape(text))
