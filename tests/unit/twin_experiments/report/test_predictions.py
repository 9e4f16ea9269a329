"""What was predicted of a run's motions stands beside what happened, in numbers and in words."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness.yaml_files import CONFIG
from twin_experiments.report.predictions import Both, Foretold, as_document, motion_rows, summary
from twin_experiments.report.report_io import write_report

from scara_msgs.msg import MotionOutcome

MOVE = Foretold(
    4.0,
    "MOVE (0.5, 0.1, 0.1)",
    MotionOutcome.REACHED,
    Both(2.0, 2.1),
    Both(0.5, 0.495),
    Both(40.0, 42.0),
    "",
)
STOPPED = replace(MOVE, at=6.0, what="HOME", end=MotionOutcome.STOPPED, time=Both(2.0, 0.4))
UNHEARD = replace(MOVE, at=8.0, time=Both(2.0, 2.02), effort=Both(40.0, None))
DRIFT = "moving time of the last 5 motions is +7.0 % off its prediction (allowed 5 %): measure"


def test_row_has_predicted_measured_and_their_difference() -> None:
    """Time, way and effort, with units."""
    assert motion_rows([MOVE, UNHEARD]) == [
        (
            *("4.0", "MOVE (0.5, 0.1, 0.1)", "reached"),
            *("2.00 s", "2.10 s", "+5.0 %"),
            *("500 mm", "495 mm", "-1.0 %"),
            *("40 %", "42 %", "+5.0 %"),
        ),
        (
            *("8.0", "MOVE (0.5, 0.1, 0.1)", "reached"),
            *("2.00 s", "2.02 s", "+1.0 %"),
            *("500 mm", "495 mm", "-1.0 %"),
            *("40 %", "-", "-"),
        ),
    ]


def test_motion_that_was_stopped_is_shown_and_compared_with_nothing() -> None:
    """Half of a way says nothing about a prediction of the whole."""
    (row,) = motion_rows([STOPPED])
    assert row[2] == "stopped on the way" and row[4] == "0.40 s"
    assert [row[k] for k in (5, 8, 11)] == ["-", "-", "-"]
    assert as_document([MOVE, STOPPED])["time_off_median_percent"] == pytest.approx(5.0)


def test_words_say_how_good_the_predictions_were() -> None:
    """The median and the worst, with its sign."""
    judged, compared, drifted = summary([MOVE, STOPPED, UNHEARD])
    assert "3 motions of this run were judged" in judged and "2 of them came to" in judged
    assert "a motion took 3.0 % longer than predicted (a single one by up to +5.0 %)" in compared
    assert "the tool's way was 1.0 % shorter (a single one by up to -1.0 %)" in compared
    assert "the largest effort was 5.0 % larger (a single one by up to +5.0 %)" in compared
    assert drifted.startswith("Nothing drifted: ")
    exact = replace(MOVE, time=Both(2.0, 2.0), effort=Both(40.0, 40.0))
    assert (
        "a motion took as long as predicted (a single one by up to +0.0 %)" in summary([exact])[1]
    )


def test_words_say_what_drifts_and_what_drifted_before() -> None:
    """With what to do about it, as the second world has told it."""
    bad = replace(MOVE, drift=DRIFT)
    assert summary([MOVE, bad])[-1] == f"At the end something drifted: {DRIFT}."
    assert summary([bad, UNHEARD])[-1] == (
        f"Nothing drifted at the end; 4.0 s after the start it was this: {DRIFT}."
    )
    assert as_document([MOVE, bad])["drift"] == DRIFT


def test_without_a_judge_nothing_is_said() -> None:
    """Neither words nor figures are made up."""
    assert summary([]) == []
    assert as_document([])["time_off_median_percent"] is None
    assert summary([STOPPED])[0].endswith("0 of them came to their target.")


def fields(drift: str = "", effort: tuple[float, ...] = (30.0, 12.0)) -> tuple[Any, ...]:
    """Return a message's fields behind its header."""
    figures = (1.5, 1.53, 0.61, 0.612)
    efforts = (np.array((25.0, 10.0)), np.array(effort))
    return ("MOVE <P1>", MotionOutcome.REACHED, *figures, ["joint_1", "joint_2"], *efforts, drift)


def test_report_of_a_bag_shows_them_on_its_page_and_in_its_figures(
    make_bag: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bag like that of a run, with two outcomes; the second one drifts."""
    monkeypatch.setattr("twin_experiments.report.report_io.write_figures", lambda *_: {})
    bag = make_bag(outcomes=((3.0, fields()), (5.0, fields(DRIFT, ()))))
    written = write_report(bag, bag.parent / "out", CONFIG)
    page = (written.folder / "report.html").read_text().replace("\u00a0", " ")
    assert '<h2 id="predicted_and_measured">Predicted and measured</h2>' in page
    assert "MOVE &lt;P1&gt;" in page and "1.53 s" in page and "+2.0 %" in page
    assert f"At the end something drifted: {DRIFT}." in page
    assert written.foretold[-1] == f"At the end something drifted: {DRIFT}."
    found = json.loads((written.folder / "report.json").read_text())["predictions"]
    assert (found["motions"], found["reached"], found["drift"]) == (2, 2, DRIFT)
    assert found["time_off_median_percent"] == pytest.approx(2.0)
    assert found["effort_off_max_percent"] == pytest.approx(20.0)
    first, second = found["each"]
    assert first["effort_measured_percent"] == 30.0 and second["effort_measured_percent"] is None
    assert second["at_s"] - first["at_s"] == pytest.approx(2.0)
