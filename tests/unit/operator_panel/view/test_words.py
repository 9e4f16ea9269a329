"""Numbers, times and states as an operator reads them."""

from __future__ import annotations

import math

import pytest
from operator_panel.view import words
from operator_panel.view.snapshot import CellState, Link
from scara_ros.page import page_words


def motion(real: bool | None, twin: bool | None) -> str:
    """Return what is said of sides that stand still, or do not; None: a side is not heard."""
    return words.motion_text(
        CellState(
            "IDLE",
            real_position=() if real is None else (0.0,),
            twin_position=() if twin is None else (0.0,),
            real_standing_still=bool(real),
            twin_standing_still=bool(twin),
        )
    )


@pytest.mark.parametrize(
    ("value", "decimals", "signed", "text"),
    [
        (-14.321, 2, False, "\N{MINUS SIGN}14.32"),
        (0.0, 2, True, "0.00"),
        (-0.004, 2, True, "0.00"),
        (0.05, 2, True, "+0.05"),
        (1e3, 0, False, "1000"),
        (math.nan, 2, False, "\N{EN DASH}"),
        (math.inf, 2, False, "\N{EN DASH}"),
    ],
)
def test_number_has_a_true_minus_and_no_minus_zero(
    value: float, decimals: int, signed: bool, text: str
) -> None:
    """What is not finite is a dash."""
    assert words.number(value, decimals, signed) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.000291, "under 1 ms"),
        (0.0041, "4 ms"),
        (-0.5, "\N{MINUS SIGN}500 ms"),
        (0.9999, "1.0 s"),
        (12.3456, "12.3 s"),
        (7384.0, "2 h 3 min"),
        (7170.5, "2 h 0 min"),
        (3599.0, "1 h 0 min"),
        (86399.0, "1 d 0 h"),
        (2 * 86400.0 - 60.0, "2 d 0 h"),
        (-1290312.0, "\N{MINUS SIGN}14 d 22 h"),
        (math.inf, "\N{EN DASH}"),
    ],
)
def test_time_is_in_the_unit_that_reads_best(value: float, text: str) -> None:
    """Nobody needs less than a millisecond; a link may be down for days."""
    assert words.seconds(value) == text


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("MOVE: OPERATOR_LEADS: both are commanded", "Both are commanded"),
        ("the real robot moved: the twin follows", "The real robot moved: the twin follows"),
        ("held in REAL_LEADS", "Held in real robot leads"),
        ("", ""),
    ],
)
def test_codes_of_the_controller_are_left_out(said: str, shown: str) -> None:
    """A fitter reads words."""
    assert page_words.people(said) == shown


@pytest.mark.parametrize(
    ("command", "fields", "title"),
    [
        ("SPEED", {"speed_percent": 40.0}, "Speed cap 40 %"),
        ("HOME", {}, "Home"),
        ("MOVE", {"x": -0.1, "y": 0.0, "z": 0.05}, "Move to x \N{MINUS SIGN}100 y 0 z 50 mm"),
    ],
)
def test_command_is_told_with_what_was_asked(
    command: str, fields: dict[str, object], title: str
) -> None:
    """In the units of the page."""
    assert words.command_title(command, fields) == title


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (words.link_state(Link("real", True)), "connected"),
        (words.link_state(Link("real", False, "no answer")), "no answer"),
        (words.link_state(Link("real", True, "no fresh data")), "no fresh data"),
        (words.link_state(Link("real", False)), "not connected"),
        (motion(True, True), "both stand still"),
        (motion(False, True), "the real robot moves"),
        (motion(True, False), "the twin moves"),
        (motion(False, False), "both move"),
        # Nobody knows that such a side stands still: the controller does not say so.
        (motion(None, True), "the real robot is not heard"),
        (motion(True, None), "the twin is not heard"),
        (motion(None, None), "neither is heard"),
        # An offset of 20000 days tells an operator nothing.
        (
            words.link_figures(Link("real", True, "", 0.004, 0.003, 1.8e9, 0.0042)),
            "values 4 ms old, answers in 3 ms, clock within 4 ms",
        ),
        (
            words.link_figures(Link("real", True, "", 0.004, 0.003, repeated=12)),
            "values 4 ms old, answers in 3 ms, 12 asked again",
        ),
    ],
)
def test_link_and_motion_are_said_of_both_sides(found: str, text: str) -> None:
    """Connected means connected and fresh."""
    assert found == text


def test_unknown_mode_is_shown_as_it_is() -> None:
    """A newer controller is not hidden."""
    assert page_words.mode_title("DANCING") == "DANCING"
