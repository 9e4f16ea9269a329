"""The tables of docs/operating/health.md, from results.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Figures = Sequence[Mapping[str, Any]]
BLOCKS = {
    "wear": ("wear",),
    "varied": ("robots", "varied"),
    "several": ("several",),
    "baselines": ("baselines",),
    "runs": ("runs",),
}
"""Of the page: the parts of ``./cell bench --health`` that a block shows."""


def health_blocks(parts: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Return what each block of the page says.

    Args:
        parts: ``health`` of results.json.
    """
    known = {part["part"]: part for part in parts}
    blocks = {}
    for block, names in BLOCKS.items():
        shown = [known[name] for name in names if name in known]
        figures = [figure for part in shown for figure in part["figures"]]
        lines = _sentences(figures) if block == "runs" else _table(figures)
        measured = "\n".join([*lines, "", *map(_measured_on, shown)])
        missing = f"Not measured yet: `./cell bench --health {' '.join(names)}`."
        blocks[block] = measured if shown else missing
    return blocks


def _table(figures: Figures) -> list[str]:
    """Lay figures out: a row of each thing, a column of each note, the goals above."""
    columns = list(dict.fromkeys(figure["note"] for figure in figures))
    goals = {figure["note"]: _goal(figure) for figure in figures}
    lines = [
        f"| | {' | '.join(columns)} |",
        "|---|" + "---|" * len(columns),
        f"| goal | {' | '.join(goals[column] for column in columns)} |",
    ]
    for what in dict.fromkeys(figure["what"] for figure in figures):
        cells = {figure["note"]: _value(figure) for figure in figures if figure["what"] == what}
        lines.append(f"| {what} | {' | '.join(cells.get(column, '') for column in columns)} |")
    return lines


def _sentences(figures: Figures) -> list[str]:
    return [
        f"- {figure['what']}: {_value(figure)} ({_goal(figure)}); {figure['note']}."
        for figure in figures
    ]


def _goal(figure: Mapping[str, Any]) -> str:
    sign = "≥" if figure["at_least"] else "≤"
    return f"{sign} {figure['goal']:g} {figure['unit']}".rstrip()


def _value(figure: Mapping[str, Any]) -> str:
    value = f"{figure['value']:.3g} {figure['unit']}".rstrip()
    return value if figure["holds"] else f"**{value}**"


def _measured_on(part: Mapping[str, Any]) -> str:
    machine = ", ".join(part["machine"].split(", ")[:3])
    return (
        f"`./cell bench --health {part['part']}`, plants `field`, {part['date']}, commit "
        f"{part['commit']}, {machine}, {part['seconds']:.0f} s.  "
    )
