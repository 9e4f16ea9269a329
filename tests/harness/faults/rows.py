"""A measured figure beside its limit."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """One line of the fault table.

    Attributes:
        fault: What was done.
        metric: What was measured, with its unit.
        limit: The largest value allowed, or the smallest if ``at_least``.
        measured: The value.
        at_least: The limit is a lower one.
    """

    fault: str
    metric: str
    limit: float
    measured: float
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the limit is kept."""
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit

    @property
    def text(self) -> str:
        """One line for a person."""
        sign = ">=" if self.at_least else "<="
        return f"{self.fault}: {self.metric} {self.measured:.4g} {sign} {self.limit:.4g}{'' if self.holds else '  BROKEN'}"

    def record(self) -> dict[str, Any]:
        """Return it for a JSON file, where infinity is no number."""
        measured = self.measured if math.isfinite(self.measured) else None
        return {**asdict(self), "measured": measured, "holds": self.holds}


def check(rows: list[Row]) -> None:
    """Print all rows, then fail with those that are broken."""
    for row in rows:
        print(row.text)
    assert rows, "nothing was measured"
    assert all(row.holds for row in rows), "\n".join(row.text for row in rows if not row.holds)


def worst(rows: list[Row]) -> list[Row]:
    """Join the rows of several runs: for each fault and metric the one furthest over its limit."""
    found: dict[tuple[str, str], Row] = {}
    for row in rows:
        key = (row.fault, row.metric)
        before = found.get(key)
        if before is None or _excess(row) > _excess(before):
            found[key] = row
    return list(found.values())


def _excess(row: Row) -> float:
    return row.limit - row.measured if row.at_least else row.measured - row.limit
