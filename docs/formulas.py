"""The formulas and the references of docstrings, as a page without any script shows them.

Docstrings have ``.. math::``, ``:math:`` and ``:func:``, which Markdown does not know. Formulas
become SVG in the colour of the text, drawn by matplotlib, which a cell has anyway.
"""

from __future__ import annotations

import io
import re
from html import escape

from matplotlib.font_manager import FontProperties
from matplotlib.mathtext import math_to_image

SIZE_PT = 12
COLOUR = "#010203"
"""Stands for the colour of the text around the formula."""
BLOCK = re.compile(r"^( *)\.\. math::[ \n]*((?:.+\n?)+)", re.MULTILINE)
INLINE = re.compile(r":math:`(.+?)`", re.DOTALL)
ROLE = re.compile(r":[a-z]+:`(~?)([^`]+)`")
OTHER_WORDS = (
    (r"\\t?frac(\d)(\d)", r"\\frac{\1}{\2}"),
    (r"\\tfrac", r"\\frac"),
    (r"\\([lg])e\b", r"\\\1eq"),
    (r"\\sqrt ([a-z])", r"\\sqrt{\1}"),
    (r"\\[bB]ig[lr]?\b", ""),
    (r"\\text\b", r"\\mathrm"),
    (r"&", ""),
)
"""What LaTeX writes, and how matplotlib writes it."""


def readable(docstring: str) -> str:
    """Return a docstring with its formulas drawn, and its references as names."""
    drawn = BLOCK.sub(lambda found: f"{found[1]}{_lines(found[2])}\n", docstring)
    drawn = INLINE.sub(lambda found: svg_of(found[1]), drawn)
    return ROLE.sub(lambda found: f"`{_name(found[2], bool(found[1]))}`", drawn)


def svg_of(latex: str) -> str:
    """Return a formula as SVG in one line, as code where matplotlib cannot draw it."""
    formula = " ".join(latex.split())
    for pattern, other in OTHER_WORDS:
        formula = re.sub(pattern, other, formula)
    buffer = io.BytesIO()
    try:
        depth = math_to_image(
            f"${formula.strip()}$",
            buffer,
            prop=FontProperties(size=SIZE_PT),
            dpi=72,
            format="svg",
            color=COLOUR,
        )
    except ValueError:
        return f"<code>{escape(' '.join(latex.split()))}</code>"
    text = buffer.getvalue().decode()
    text = re.sub(
        r"<metadata>.*?</metadata>|<!--.*?-->", "", text[text.index("<svg") :], flags=re.DOTALL
    )
    text = " ".join(text.replace(COLOUR, "currentColor").split())
    return text.replace("<svg", f'<svg style="vertical-align:-{depth:.1f}pt"', 1)


def _lines(latex: str) -> str:
    """Return a formula of several lines, each drawn, below each other."""
    return "<br>".join(svg_of(line) for line in re.split(r"\\\\", latex) if line.strip())


def _name(target: str, short: bool) -> str:
    """Return what a reference shows: all of its target, or its last word."""
    return target.rpartition(".")[2] if short else target
