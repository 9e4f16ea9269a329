"""The table of the second world, from results.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def what_if_table(parts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the section of bench/tables.txt: Markdown lines.

    Args:
        parts: ``what_if`` of results.json.
    """
    return lines_of("The second world", "--what-if", parts)


def lines_of(heading: str, option: str, parts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a section of figures that were measured in parts.

    Args:
        heading: Of the section.
        option: Of ``./cell bench``, which measures it.
        parts: Each with its figures, and when and on what they were measured.
    """
    lines = [
        f"## {heading}",
        "",
        "| what | measured | goal | holds | |",
        "|---|---|---|---|---|",
        *(_line(figure) for part in parts for figure in part["figures"]),
        "",
    ]
    return [*lines, *(_measured_on(option, part) for part in parts), ""]


def missed_lines(parts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the figures of parts that do not hold, with date and commit: Markdown lines."""
    lines = [
        f"{_line(figure)} {part['date']}, commit {part['commit']} |"
        for part in parts
        for figure in part["figures"]
        if not figure["holds"]
    ]
    head = ["| what | measured | goal | holds | | measured on |", "|---|---|---|---|---|---|"]
    return [*head, *lines] if lines else []


def _measured_on(option: str, part: Mapping[str, Any]) -> str:
    """Say when and on what a part was measured: a label is part of a figure."""
    return (
        f"- `./cell bench {option} {part['part']}`: {part['date']}, commit {part['commit']}, "
        f"{part['machine']}, load before {part['load_before']:.1f}, {part['seconds']:.0f} s."
    )


def _line(figure: Mapping[str, Any]) -> str:
    sign = "≥" if figure["at_least"] else "≤"
    unit = f" {figure['unit']}".rstrip()
    value = f"{figure['value']:.3g}{unit}"
    shown = value if figure["holds"] else f"**{value}**"
    verdict = "yes" if figure["holds"] else "**no**"
    goal = f"{sign} {figure['goal']:g}{unit}"
    return f"| {figure['what']} | {shown} | {goal} | {verdict} | {figure['note']} |"
