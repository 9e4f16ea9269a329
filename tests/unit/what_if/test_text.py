"""A verdict in words: what speaks against it first, and no more than a person reads."""

from __future__ import annotations

import pytest
from what_if.text import caption_of, lines_of
from what_if.verdict import Cause, Clearance, Outcome, Reason, Verdict


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


def test_a_picture_tells_the_nearest_two_unless_the_motion_is_refused() -> None:
    """Of what is refused the reason counts; nothing is near where nothing moves."""
    near = Clearance(12.34, 12.0, ("tool", "table"), 1.5)
    for outcome in Outcome:
        sentence, *nearest = caption_of(Verdict(outcome, clearance=near))
        assert sentence == Verdict(outcome).sentence
        told = ["Nearest at 1.50 s: 12.3 mm between tool and table"]
        assert nearest == ([] if outcome is Outcome.REFUSED else told)
        assert caption_of(Verdict(outcome)) == [sentence]
