"""What to press in each mode: complete, true of the state, and the same in the document."""

from __future__ import annotations

import re

import pytest
from harness.workspace import ROOT
from operator_panel.control.mode_table import ROWS, RUN, next_step
from operator_panel.view.snapshot import CellState
from operator_panel.view.words import roles, speed_reason
from scara_config.robot import LEAD_IS_FALSE
from scara_ros.page.page_words import MODES

PAGE = (ROOT / "docs" / "operator.md").read_text(encoding="utf-8")


def test_each_mode_has_one_row() -> None:
    """No mode leaves a person alone."""
    assert [row.mode for row in ROWS] == list(MODES)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.mode)
def test_document_has_the_row_of_the_page(row: object) -> None:
    """Who reads it at a desk reads the same at the robot."""
    assert f"| {row.title} | {row.meaning} | {row.press} |" in PAGE  # type: ignore[attr-defined]


@pytest.mark.parametrize("row", [row for row in ROWS if row.button not in ("", RUN)])
def test_the_button_is_named_in_the_words(row: object) -> None:
    """Words and colour lead to the same button."""
    assert re.search(rf"\b{row.button}\b", row.press, re.IGNORECASE)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("mode", "diverged", "button"),
    [
        ("PAUSED", False, "RESUME"),
        ("PAUSED", True, "ACKNOWLEDGE"),
        ("IDLE", False, RUN),
        ("IDLE", True, "ALIGN"),
        ("ESTOP", True, "RESET"),
        ("DANCING", True, ""),
    ],
)
def test_a_pair_that_came_apart_is_looked_at_first(mode: str, diverged: bool, button: str) -> None:
    """Resume is refused until somebody has acknowledged."""
    assert next_step(CellState(mode, diverged=diverged))[1] == button


@pytest.mark.parametrize(("mode", "told"), [("IDLE", True), ("REAL_LEADS", True), ("FAULT", False)])
def test_a_robot_that_is_only_followed_says_so_and_why(mode: str, told: bool) -> None:
    """Where a person would move the pair or hold it; a fault has its own words."""
    silent = "the twin alone, no zone slows the robot"
    for why, stops in ((f"{LEAD_IS_FALSE}: x", silent), ("untried", "the twin")):
        words, button = next_step(CellState(mode=mode, only_followed=why))
        said = f"The robot is only followed. STOP stops {stops}. {why}."
        assert (words == said) == told
        assert (button == "STOP") == told


def test_the_speed_of_a_robot_that_hears_nothing_is_its_own() -> None:
    """Why the pair would be slow says nothing about it."""
    why = f"{LEAD_IS_FALSE}: x"
    state = CellState(only_followed=why, speed_requested_percent=50.0, speed_limited=True)
    assert "pendant sets" in speed_reason(state) and "lowered" not in speed_reason(state)


@pytest.mark.parametrize(("stands", "said"), [(True, "is held"), (False, "moves on")])
def test_a_paused_page_holds_no_robot_that_moves(stands: bool, said: str) -> None:
    """Nothing from here reaches it."""
    paused = CellState(mode="PAUSED", only_followed="lead is false", real_standing_still=stands)
    assert roles(paused)[0] == said
