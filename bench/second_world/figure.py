"""A figure beside its goal, of the second world or of the farm."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from harness.faults.rows import Row


@dataclass(frozen=True)
class Figure:
    """One line of the table.

    Attributes:
        what: Is measured.
        unit: Of goal and value.
        goal: The largest value that holds, the smallest if ``at_least``.
        value: As measured.
        at_least: The goal is a lower one.
        note: How many, of what; shown beside it.
        always: No busy machine excuses a value beyond the goal.
    """

    what: str
    unit: str
    goal: float
    value: float
    at_least: bool = False
    note: str = ""
    always: bool = False

    @property
    def holds(self) -> bool:
        """Whether the goal is kept."""
        return self.row().holds

    def row(self) -> Row:
        """Return it for the console."""
        metric = f"{self.note} [{self.unit}]" if self.unit else self.note
        return Row(self.what, metric, self.goal, self.value, self.at_least, self.always)

    def record(self) -> dict[str, Any]:
        """Return it for results.json."""
        return {**asdict(self), "holds": self.holds}
