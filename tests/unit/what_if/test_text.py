"""A verdict in words: what speaks against it first, and no more than a person reads."""

from __future__ import annotations

import pytest
from what_if.text import lines_of
from what_if.verdict import Cause, Outcome, Reason, Verdict


@pytest.mark.parametrize("count", range(7))
def test_four_reasons_are_told_and_the_others_counted(count: int) -> None:
    """Only where there are others."""
    reasons = tuple(
        Reason(Cause.COLLISION, float(n), f"line {n}", (1.0, 2.0, 3.0), f"hits {n}")
        for n in range(count)
    )
    lines = lines_of(Verdict(Outcome.REFUSED if count else Outcome.OK, reasons))
    also = [f"  also: {n}.00 s, line {n}: hits {n}" for n in range(1, min(count, 4))]
    more = [f"  and {count - 4} more"] if count > 4 else []
    place = ["place      (1, 2, 3) mm"] if count else []
    assert lines[1:] == [*also, *more, *place]
