"""The report as one HTML file: images embedded, no request outside, readable in light and dark."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined

NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(mm|ms|s|%)(?!\w))")
NO_BREAK = "\u00a0"
TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{{ title }}</title>
<style>
:root { --ink: #1f2937; --soft: #6b7280; --paper: #ffffff; --line: #e5e7eb;
  --good: #15803d; --bad: #c81e3a; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e5e7eb; --soft: #9ca3af; --paper: #14161a; --line: #333842;
    --good: #4ade80; --bad: #fb7185; }
  img { filter: invert(0.92) hue-rotate(180deg); }
}
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  margin: 2rem auto; max-width: 68rem; padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin: 2.2rem 0 0.4rem; border-bottom: 1px solid var(--line); }
p.soft, td.soft, figcaption { color: var(--soft); }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 0.3rem 0.9rem 0.3rem 0; vertical-align: top;
  border-bottom: 1px solid var(--line); }
th { color: var(--soft); font-weight: 600; } td.mid { white-space: nowrap; }
.pass { color: var(--good); font-weight: 700; } .FAIL { color: var(--bad); font-weight: 700; }
.sentence { margin: 0.6rem 0; border-left: 0.3rem solid; padding-left: 0.8rem; }
.label { margin: 1rem 0; } .label th { width: 8rem; } .label td { overflow-wrap: anywhere; }
figure { margin: 1rem 0; } img { width: 100%; height: auto; display: block; }
details { margin: 0.6rem 0; } summary { cursor: pointer; }
pre { overflow-x: auto; font-size: 13px; }
.scroll { overflow-x: auto; }
</style>
</head>
<body>
{% macro table(headings, rows) %}
<div class="scroll"><table>
<tr>{% for heading in headings %}<th>{{ heading }}</th>{% endfor %}</tr>
{% for row in rows %}<tr>
{% for cell in row %}
<td{% if cell in ("pass", "FAIL") %} class="{{ cell }}"{% endif %}>
{{- cell | with_units }}</td>{% endfor %}
</tr>
{% endfor %}</table></div>
{% endmacro %}
<h1>{{ title }}</h1>
{% for verdict, text in sentences %}<p class="sentence {{ verdict }}">{{ text | with_units }}</p>
{% endfor %}
{% if label %}<table class="label">
{% for name, text in label %}<tr><th>{{ name }}</th><td>{{ text }}</td></tr>
{% endfor %}</table>{% endif %}
<p class="soft">{{ subtitle }}</p>
{{ table(headings, rows) }}
<p class="soft">{{ legend }}</p>
{% for experiment in experiments %}
<h2>{{ experiment.name }}
<span class="{{ experiment.verdict }}">{{ experiment.verdict }}</span></h2>
{% if experiment.reasons %}<ul>
{% for reason in experiment.reasons %}<li>{{ reason }}</li>{% endfor %}
</ul>{% endif %}
{% for note in experiment.notes %}<p>{{ note | with_units }}</p>
{% endfor %}
{% for caption, data in experiment.figures %}<figure><figcaption>{{ caption }}</figcaption>
<img alt="{{ caption }}" src="data:image/png;base64,{{ data }}"></figure>{% endfor %}
{% for name, part in experiment.tables %}{% if part.rows %}<h3>{{ name }}</h3>
{{ table(part.headings, part.rows) }}{% endif %}{% endfor %}
{% endfor %}
{% for name, part in tables %}<h2>{{ name }}</h2>
{% if part.rows %}{{ table(part.headings, part.rows) }}{% else %}<p class="soft">none</p>{% endif %}
{% endfor %}
<h2>Configuration</h2>
<p class="soft">{{ configuration_origin }}</p>
{% for name, text in configuration %}
<details><summary>{{ name }}</summary><pre>{{ text }}</pre></details>{% endfor %}
</body>
</html>
"""


def embedded(image: Path) -> str:
    """Return a PNG as text for an ``img`` tag."""
    return base64.b64encode(image.read_bytes()).decode("ascii")


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Mapping[str, Any]:
    """Return a table as the template takes it."""
    return {"headings": headings, "rows": rows}


def render(content: Mapping[str, Any]) -> str:
    """Fill the page; a name that the template uses and ``content`` lacks is an error."""
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    environment.filters["with_units"] = with_units
    return environment.from_string(TEMPLATE).render(content)


def with_units(text: str) -> str:
    """Return a text in which no line ends between a number and its unit."""
    return NUMBER_AND_UNIT.sub(NO_BREAK, text)
