"""Fill the page of a report."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from twin_experiments.report.page.charts_io import SCRIPT, chart_library
from twin_experiments.report.page.style_io import STYLE
from twin_experiments.report.page.template_io import TEMPLATE

NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(mm|ms|s|%)(?!\w))")
NO_BREAK = "\u00a0"
MISSING: Mapping[str, Any] = {
    "verdict": None,
    "missing": "",
    "sentences": (),
    "short": None,
    "short_legend": "",
    "label": (),
    "configuration": (),
    "configuration_origin": "",
}


def figure(caption: str, image: Path, chart: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """Return a figure as the template takes it; ``chart``: the same to zoom into and to read."""
    # A PNG as text for an img tag
    return {
        "caption": caption,
        "image": base64.b64encode(image.read_bytes()).decode("ascii"),
        "chart": chart,
    }


def table(
    headings: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[str] = ()
) -> Mapping[str, Any]:
    """Return a table as the template takes it; ``words`` stand above it."""
    return {"headings": headings, "rows": rows, "words": words}


def render(content: Mapping[str, Any]) -> str:
    """Fill the page; a name that the template uses and ``content`` lacks is an error.

    Raises:
        OSError: The chart library that belongs to the installed packages cannot be read.
    """
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    environment.filters.update(with_units=with_units, as_json=as_json, anchor=anchor)
    drawn = any(one["chart"] for each in content["experiments"] for one in each["figures"])
    return environment.from_string(TEMPLATE).render(
        {
            **MISSING,
            **content,
            "style": STYLE,
            "library": chart_library() if drawn else "",
            "script": SCRIPT,
        }
    )


def with_units(text: str) -> str:
    """Return a text in which no line ends between a number and its unit."""
    return NUMBER_AND_UNIT.sub(NO_BREAK, text)


def as_json(tree: Any) -> Markup:
    """Return data for a script element: nothing in it can end the element."""
    text = json.dumps(tree, separators=(",", ":"))
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))


def anchor(name: str) -> str:
    """Return a name as the target of a link inside the page."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
