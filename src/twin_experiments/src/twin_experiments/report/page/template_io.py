"""The page of a report, as Jinja fills it."""

TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{{ title }}</title>
<style>{{ style | safe }}</style>
</head>
<body>
{% macro table(headings, rows, kind="") %}
<div class="scroll {{ kind }}{% if headings | length > 2 %} stack{% endif %}"><table>
<tr>{% for heading in headings %}<th>{{ heading }}</th>{% endfor %}</tr>
{% for row in rows %}<tr>
{% for cell in row %}
<td data-heading="{{ headings[loop.index0] }}"
{%- if cell in ("pass", "FAIL") %} class="{{ cell }}"{% endif %}>
{{- cell | with_units }}</td>{% endfor %}
</tr>
{% endfor %}</table></div>
{% endmacro %}
<header>
<h1>{{ title }}</h1>
{% if verdict %}<p class="verdict {{ verdict[0] }}">{{ verdict[1] | with_units }}</p>{% endif %}
{% if missing %}<p class="sentence FAIL">{{ missing }}</p>{% endif %}
{% for passed, text in sentences %}<p class="sentence {{ passed }}">{{ text | with_units }}</p>
{% endfor %}
{% if short %}{{ table(short.headings, short.rows, "short") }}
<p class="soft">Percent are of the robot's reach. {{ short_legend }}</p>{% endif %}
<nav class="contents" aria-label="Contents"><h2>Contents</h2><ol>
{% if label %}<li><a href="#made_with">What the figures were made with</a></li>{% endif %}
<li><a href="#figures">All figures</a></li>
{% for experiment in experiments -%}
<li><a href="#{{ experiment.id }}">{{ experiment.name }}</a></li>
{% endfor %}
{% for name, part in tables -%}
<li><a href="#{{ name | anchor }}">{{ name }}</a></li>
{% endfor %}
{% if configuration %}<li><a href="#configuration">Configuration</a></li>{% endif %}
</ol></nav>
</header>
{% if label %}<h2 id="made_with">What the figures were made with</h2><table class="label">
{% for name, text in label %}<tr><th>{{ name }}</th><td>{{ text }}</td></tr>
{% endfor %}</table>{% endif %}
<p class="soft">{{ subtitle }}</p>
<h2 id="figures">All figures</h2>
{{ table(headings, rows) }}
<p class="soft">{{ legend }}</p>
{% for experiment in experiments %}
<section class="experiment">
<h2 id="{{ experiment.id }}">{{ experiment.name }}
<span class="{{ experiment.verdict }}">{{ experiment.verdict }}</span></h2>
{% if experiment.reasons %}<ul>
{% for reason in experiment.reasons %}<li>{{ reason }}</li>{% endfor %}
</ul>{% endif %}
{% for note in experiment.notes %}<p>{{ note | with_units }}</p>
{% endfor %}
{% for figure in experiment.figures %}<figure>
<figcaption><b>{{ figure.caption }}</b>{% if figure.chart %} <span class="how">Drag the ends of the
lower bar to zoom, point to read values, press a name to hide its line.</span>{% endif %}
</figcaption>
<img alt="{{ figure.caption }}" src="data:image/png;base64,{{ figure.image }}">
{% if figure.chart %}<div class="chart"></div>
<script type="application/json">{{ figure.chart | as_json }}</script>{% endif %}
</figure>{% endfor %}
{% for name, part in experiment.tables %}{% if part.rows %}
<details class="printed"><summary>{{ name }} ({{ part.rows | length }})</summary>
{{ table(part.headings, part.rows) }}</details>{% endif %}{% endfor %}
</section>
{% endfor %}
{% for name, part in tables %}<h2 id="{{ name | anchor }}">{{ name }}</h2>
{% for text in part.words %}<p>{{ text | with_units }}</p>
{% endfor %}{% if part.rows %}
<details{% if part.rows | length <= 12 %} open{% endif %} class="printed">
<summary>{{ part.rows | length }} {{ "row" if part.rows | length == 1 else "rows" }}</summary>
{{ table(part.headings, part.rows) }}</details>
{% else %}<p class="soft">none</p>{% endif %}
{% endfor %}
{% if configuration_origin %}<h2 id="configuration">Configuration</h2>
<p class="soft">{{ configuration_origin }}</p>
{% for name, text in configuration %}
<details><summary>{{ name }}</summary><pre>{{ text }}</pre></details>{% endfor %}{% endif %}
{% if library %}<script type="module">{{ library | safe }}</script>
<script type="module">{{ script | safe }}</script>{% endif %}
</body>
</html>
"""
