"""Details of the page that a reader sees."""

from __future__ import annotations

import pytest
from twin_experiments.report.page_io import as_json, chart_library, with_units


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


def test_data_cannot_end_the_element_that_holds_it() -> None:
    """A recording's name comes from a file that anybody may have made."""
    text = str(as_json({"name": "</script><script>alert(1)</script>&"}))
    assert "<" not in text and ">" not in text and "&" not in text
    assert "\\u003c/script\\u003e" in text


def test_the_chart_library_is_found_where_it_is_installed() -> None:
    """It belongs to an installed package: another version of that may pack it otherwise."""
    text = chart_library()
    assert text.rstrip().endswith(";") and "window.echarts=" in text[-60:]
    assert "export{" not in text and "</script" not in text
