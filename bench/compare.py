"""What got worse since the last measurement, by more than its figures lie apart anyway."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bench.page import number

REPEATS_PERCENT = 20.0
"""Medians on one machine repeat to about this; a figure without rounds has no spread of its own."""
Row = Mapping[str, Any]


def worse(before: Sequence[Row], now: Sequence[Row]) -> list[str]:
    """Say in one line for each figure what got worse.

    A row with a baseline is compared by its ratio, which a slower machine does not change. Any
    other figure is compared with one of the same machine only.

    Args:
        before: Rows as in results.json.
        now: Rows of this run, likewise.
    """
    known = {row["id"]: row for row in before}
    return [text for row in now if row["id"] in known for text in _row(known[row["id"]], row)]


def not_compared(before: Sequence[Row], now: Sequence[Row]) -> list[str]:
    """Return the names of rows that cannot be compared: new ones, those of another machine."""
    known = {row["id"]: row for row in before}
    return [
        row["id"]
        for row in now
        if row["id"] not in known
        or (row["ratio"] is None and not _same_machine(known[row["id"]], row))
    ]


def _row(before: Row, now: Row) -> Iterator[str]:
    name = now["id"]
    if now["ours"] is None:
        if before["ours"] is not None:
            yield f"{name}: not measured any more: {now['note']}"
        return
    what = "ratio" if before["ratio"] and now["ratio"] else "ours"
    same = _same_machine(before, now)
    if before["ours"] is not None and (what == "ratio" or same):
        more = ">=" in now["goal"]
        unit = "" if what == "ratio" else f" {now['unit']}"
        yield from _figure(
            f"{name}: {what}",
            before[what],
            now[what],
            max(_spread(before), _spread(now)),
            more,
            unit,
        )
    if before["holds"] and not now["holds"]:
        yield f"{name}: held its goals before, and does not now"
    if same:
        yield from _beside(name, before["beside"], now["beside"])


def _beside(name: str, before: Sequence[Row], now: Sequence[Row]) -> Iterator[str]:
    """Compare the figures beside a row that have a goal; the others only explain."""
    known = {figure["what"]: figure for figure in before}
    for figure in now:
        old = known.get(figure["what"])
        if figure["goal"] and figure["value"] is not None and old and old["value"] is not None:
            more = ">" in figure["goal"]
            what, unit = f"{name}: {figure['what']}", f" {figure['unit']}"
            yield from _figure(what, old["value"], figure["value"], REPEATS_PERCENT, more, unit)


def _figure(
    what: str, old: float, new: float, spread: float, more: bool, unit: str
) -> Iterator[str]:
    """Say that a figure got worse, if it did by more than ``spread`` [percent of the old one]."""
    change = (old - new) if more else (new - old)
    if change > abs(old) * spread * 1e-2:
        yield f"{what} {number(old)} -> {number(new)}{unit}, the rounds lie {spread:.0f} % apart"


def _spread(row: Row) -> float:
    """Return how far the rounds of both sides lie apart [percent]; at least what repeats anyway."""
    sides = (row["spread_percent"], row["baseline_spread_percent"] if row["ratio"] else None)
    return max(REPEATS_PERCENT, sum(part for part in sides if part is not None))


def _same_machine(before: Row, now: Row) -> bool:
    return bool(before.get("machine", "") == now.get("machine", ""))
