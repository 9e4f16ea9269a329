"""What is typed is a number, or the reason stands beside the field."""

from __future__ import annotations

import pytest
from operator_panel.control.fields import FieldError, error_text, parse_number, parse_run_name
from operator_panel.runs import BESIDE


@pytest.mark.parametrize(
    ("text", "value"),
    [("510", 510.0), (" -1.5 ", -1.5), ("\N{MINUS SIGN}160", -160.0), ("1e2", 100.0), (7, 7.0)],
)
def test_number_is_read(text: object, value: float) -> None:
    """The true minus sign of the page can be copied back into a field."""
    assert parse_number(text, "X", "mm") == value


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "X is empty: a number in mm"),
        (None, "X is empty"),
        ("0,65", "write the decimal with a point"),
        ("abc", "'abc' is no number"),
        ("nan", "no finite number"),
        ("inf", "no finite number"),
        ("101", "101 mm is outside 1 to 100 mm"),
        ("0.5", "outside 1 to 100"),
    ],
)
def test_what_is_no_number_in_range_is_refused_in_words(text: object, why: str) -> None:
    """The text stands beside the field."""
    with pytest.raises(FieldError, match=why):
        parse_number(text, "X", "mm", 1.0, 100.0)


@pytest.mark.parametrize("name", ["", "run_1", "2026-01-01.a", "x" * 64])
def test_good_name_of_a_run_is_kept(name: str) -> None:
    """Empty lets the recorder choose."""
    assert parse_run_name(f" {name} ") == name


@pytest.mark.parametrize("name", ["../x", "a/b", ".hidden", "a b", "x" * 65, "-rf", "a\nb"])
def test_name_that_could_leave_the_folder_is_refused(name: str) -> None:
    """It becomes a folder."""
    with pytest.raises(FieldError, match="letters, digits"):
        parse_run_name(name)


@pytest.mark.parametrize("name", BESIDE)
def test_a_recording_does_not_go_into_a_folder_of_others(name: str) -> None:
    """To delete it would delete what they keep."""
    with pytest.raises(FieldError, match=f"{name}: others keep .*: choose another name"):
        parse_run_name(f" {name} ")


def test_error_text_is_none_for_what_is_right() -> None:
    """As nicegui's validation wants it."""
    assert error_text(lambda: parse_number("1", "X", "mm")) is None
    assert error_text(lambda: parse_number("x", "X", "mm")) == "'x' is no number"
