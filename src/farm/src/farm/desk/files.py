"""The names of the history's files, and which of them count; pure.

A file is ``FIRST-LAST.parquet``: the places of its events in the order in which they were kept.
Several small files become one by writing the large one first and removing the small ones then.
Whoever is killed between the two leaves files whose places another file holds: they do not count.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

NAME = re.compile(r"^(\d{12})-(\d{12})\.parquet\Z")


class EventSpan(NamedTuple):
    """The places of a file's events: from first to last, both included."""

    first: int
    last: int

    @property
    def name(self) -> str:
        """The file's name.

        Example:
            >>> EventSpan(1, 20).name
            '000000000001-000000000020.parquet'
        """
        return f"{self.first:012d}-{self.last:012d}.parquet"


def span_of(name: str) -> EventSpan | None:
    """Return the places of a file by its name; None if it is no file of the history."""
    found = NAME.match(name)
    return EventSpan(int(found[1]), int(found[2])) if found else None


def counting(names: Iterable[str]) -> tuple[list[EventSpan], list[EventSpan]]:
    """Return the files that count, in their order, and those whose events another one holds.

    Example:
        >>> spans = EventSpan(1, 2), EventSpan(3, 3), EventSpan(1, 3)
        >>> kept, held = counting([*(span.name for span in spans), "x.tmp"])
        >>> kept == [spans[2]], held == [*spans[:2]]
        (True, True)
    """
    # Of two that begin at one place the longer one first, which may hold the other.
    spans = sorted(
        (span for name in names if (span := span_of(name))), key=lambda s: (s.first, -s.last)
    )
    kept: list[EventSpan] = []
    held: list[EventSpan] = []
    for span in spans:
        inside = bool(kept) and span.last <= kept[-1].last
        (held if inside else kept).append(span)
    return kept, held


def to_join(
    spans: Sequence[EventSpan], sizes: Sequence[int], most: int, large: int
) -> list[EventSpan]:
    """Return the small files to make one of: the last ones in a row, or none.

    Args:
        spans: The files that count, in their order.
        sizes: Of each [bytes].
        most: So many small files may be there.
        large: A file of this size or more is left as it is [bytes].
    """
    row: list[EventSpan] = []
    for span, size in zip(reversed(spans), reversed(sizes)):
        if size >= large:
            break
        row.insert(0, span)
    return row if len(row) >= most else []
