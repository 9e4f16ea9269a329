"""A measured figure beside its limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from harness.running.repeats import (
    ATTEMPTS,
    NOTES,
    Looks,
    excuse,
    first_words,
    is_played_out,
    played_out,
)
from harness.running.standstill import MACHINE


@dataclass(frozen=True)
class Row:
    """One line of the fault table.

    Attributes: fault: What was done. metric: What was measured, with its unit. limit: The largest
    value allowed, or the smallest if ``at_least``. measured: The value. at_least: The limit is a
    lower one. always: No busy machine excuses a value beyond the limit: what may never happen, not
    even once.
    """

    fault: str
    metric: str
    limit: float
    measured: float
    at_least: bool = False
    always: bool = False

    @property
    def holds(self) -> bool:
        """Whether the limit is kept."""
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit

    @property
    def text(self) -> str:
        """One line for a person."""
        sign = ">=" if self.at_least else "<="
        end = "" if self.holds else "  BROKEN"
        return f"{self.fault}: {self.metric} {self.measured:.4g} {sign} {self.limit:.4g}{end}"

    def record(self) -> dict[str, Any]:
        """Return it for a JSON file, where infinity is no number."""
        measured = self.measured if math.isfinite(self.measured) else None
        return {**asdict(self), "measured": measured, "holds": self.holds}


def check(measure: Callable[[], list[Row]]) -> None:
    """Measure and print.

    Fail if a row that must always hold is broken, or another one in every attempt. That is final:
    the whole test is not played again for it.
    """
    try:
        rows, _ = repeated(measure, note=NOTES.add)
        assert rows, "nothing was measured"
        assert all(row.holds for row in rows), "\n".join(row.text for row in rows if not row.holds)
    except AssertionError as error:
        played_out(error)
        raise


def must(holds: bool, text: str) -> None:
    """Fail for good where something does not hold: no busy machine is the cause.

    Raises:
        AssertionError: It does not; nobody measures again for it.
    """
    if not holds:
        error = AssertionError(text)
        played_out(error)
        raise error


def repeated(
    measure: Callable[[], list[Row]],
    attempts: int = ATTEMPTS,
    looks: Looks = MACHINE,
    note: Callable[[str], None] = print,
) -> tuple[list[Row], list[str]]:
    """Measure until all rows hold; return the last rows, and for each repetition what was missed.

    Times are measured on a machine that does other things too. So what failed is measured again,
    ``attempts`` times at most, but only if the machine was seen to stand still meanwhile. A row
    that must always hold, and what :func:`must` has found, has no second chance. ``note`` is told
    of each repetition at once.

    Raises:
        AssertionError: The last attempt did not come to an end as described.
    """
    missed: list[str] = []
    while True:
        begun = looks.now()
        try:
            rows = measure()
        except AssertionError as error:
            why = excuse(begun, looks)
            if is_played_out(error) or len(missed) == attempts - 1 or not why:
                raise
            missed.append(f"{why}; not measured: {first_words(error)}")
            note(missed[-1])
            continue
        for row in rows:
            print(row.text)
        broken = [row for row in rows if not row.holds]
        if not broken or len(missed) == attempts - 1 or any(row.always for row in broken):
            return rows, missed
        why = excuse(begun, looks)
        if not why:
            return rows, missed
        missed.append(f"{why}; {'; '.join(row.text for row in broken)}")
        note(missed[-1])


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
    if math.isnan(row.measured):
        return math.inf  # compared with nothing, and no limit holds for it
    return row.limit - row.measured if row.at_least else row.measured - row.limit
