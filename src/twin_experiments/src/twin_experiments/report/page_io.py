"""Fill the page of a report: ``web/report.html``, which needs nothing beside itself."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from scara_config import package_folder

ENTRY = re.compile(r'import\{(\w+) as \w+.*?\}from"\./([\w-]+\.js)"')
MODULE_END = re.compile(r"export\{([^{}]*)\};?\s*(?://# sourceMappingURL=\S*\s*)?\Z")
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
    web = package_folder("twin_experiments") / "web"
    page, style, script = (
        (web / f"report.{kind}").read_text(encoding="utf-8") for kind in ("html", "css", "js")
    )
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    environment.filters.update(with_units=with_units, as_json=as_json, anchor=anchor)
    drawn = any(one["chart"] for each in content["experiments"] for one in each["figures"])
    return environment.from_string(page).render(
        {
            **MISSING,
            **content,
            "style": style,
            "library": chart_library() if drawn else "",
            "script": script,
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


@cache
def chart_library() -> str:
    """Return the text of a module that sets ``window.echarts``.

    It is Apache ECharts as nicegui brings it for the operator's page: one more copy of it in the
    project would have to be kept up to date by hand.

    Raises:
        OSError: nicegui has no such library any more, or it is packed in another way.
    """
    spec = find_spec("nicegui")
    if spec is None or spec.origin is None:
        raise OSError("the chart library of reports is nicegui's: nicegui is not installed")
    folder = Path(spec.origin).parent / "elements" / "echart" / "dist"
    entry = ENTRY.search((folder / "index.js").read_text(encoding="utf-8"))
    if entry is None:
        raise OSError(f"{folder / 'index.js'}: no chart library is found in it")
    text = (folder / entry[2]).read_text(encoding="utf-8")
    end = MODULE_END.search(text)
    name = end and re.search(rf"([\w$]+) as {re.escape(entry[1])}(?:,|\Z)", end[1])
    # A closing tag in it would end the script element in the middle of the library.
    if end is None or not name or "</script" in text:
        raise OSError(f"{folder / entry[2]}: no chart library is found in it")
    return f"{text[: end.start()]}window.echarts={name[1]};"
