"""Details of the page that a reader sees."""

from __future__ import annotations

import pytest
from twin_experiments.io.page import with_units


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("9.93 mm  1.528 %", "9.93\u00a0mm  1.528\u00a0%"),
        ("+25.1 ms", "+25.1\u00a0ms"),
        ("2 sides, 3 mmm", "2 sides, 3 mmm"),
        ("(limit 2 %), and", "(limit 2\u00a0%), and"),
        ("pass", "pass"),
    ],
)
def test_a_number_stays_beside_its_unit(text: str, shown: str) -> None:
    """A percent sign alone on a line is hard to read."""
    assert with_units(text) == shown
