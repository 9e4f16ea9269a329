"""The one cell that goes away from its own past is found, and no other."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeAlias

import pytest
from farm.desk.command_line_io import app
from farm.desk.figures import DRIFTS, MEDIANS, FigureDrift
from farm.desk.history_io import History, Kept
from farm.desk.lines import key_figures_io  # noqa: F401  (adds the word)
from farm.desk.reading_io import ask_for
from farm.keys import CellName
from farm.wire import Event
from harness.running.thorough import thorough
from typer.testing import CliRunner

FIGURE = "lag of the robot [s]"
GIVEN = """
  SELECT unnest($cells) AS cell, unnest($figures) AS figure, unnest($spans) AS place,
    unnest($medians) AS value
"""
Median: TypeAlias = tuple[str, int, float]
"""Cell, number of the span, and the figure's median in it."""
FindDrifts: TypeAlias = Callable[[Iterable[Median]], list[FigureDrift]]


def medians(
    cells: int = 100, days: int = 30, seed: int = 0, away: float = 0.0, all_cells: float = 0.0
) -> list[Median]:
    """Return medians of many cells, of which the 17th goes away in the last third of the time."""
    chance, made = random.Random(seed), []
    for cell in range(cells):
        level = 0.084 * chance.uniform(0.9, 1.1)
        for day in range(days):
            late = max(0.0, (day - days * 2 / 3) / (days / 3))
            value = level * (1.0 + all_cells * late + (away * late if cell == 17 else 0.0))
            made.append((f"m/cell_{cell:03d}", day, value * chance.gauss(1.0, 0.01)))
    chance.shuffle(made)
    return made


@pytest.fixture
def find_drifts(tmp_path: Path) -> FindDrifts:
    """Return what judges given medians in place of those of a history, which is empty here."""
    assert MEDIANS in DRIFTS

    def found(known: Iterable[Median]) -> list[FigureDrift]:
        cells, spans, values = map(list, zip(*known))
        told = {"cells": cells, "figures": [FIGURE] * len(cells), "spans": spans, "medians": values}
        return ask_for(tmp_path, FigureDrift, DRIFTS.replace(MEDIANS, GIVEN), told)

    return found


@pytest.mark.parametrize("seed", range(5))
def test_the_one_cell_that_drifts_is_found_and_no_other(find_drifts: FindDrifts, seed: int) -> None:
    """Among 100 cells that differ from each other more than the drift is large."""
    found = find_drifts(medians(seed=seed, away=0.3))
    assert [drift.cell for drift in found if drift.drifts] == ["m/cell_017"]
    assert found[0].now > 1.2 * found[0].before


@pytest.mark.parametrize("seed", [*range(6), *thorough(*range(6, 20))])
def test_cells_at_rest_are_not_named(find_drifts: FindDrifts, seed: int) -> None:
    """2,000 figures, none of which drifts."""
    assert not any(drift.drifts for drift in find_drifts(medians(seed=seed)))


def test_what_moves_all_cells_is_no_drift_of_one(find_drifts: FindDrifts) -> None:
    """A warm week; the one that does not go along is named."""
    found = find_drifts(medians(all_cells=0.2, away=-0.2))
    assert [drift.cell for drift in found if drift.drifts] == ["m/cell_017"]


@pytest.mark.parametrize(("cells", "named"), [(4, 4), (5, 0)])
def test_fewer_than_five_cells_are_judged_each_for_itself(
    find_drifts: FindDrifts, cells: int, named: int
) -> None:
    """All of them move: whether together, so few cannot tell."""
    found = find_drifts(medians(cells=cells, all_cells=0.5))
    assert sum(drift.drifts for drift in found) == named


def test_a_slow_drift_does_not_become_its_own_past(find_drifts: FindDrifts) -> None:
    """A step of 1 % a day hides in no noise."""
    row = [("m/a", day, 1.0 + 0.01 * day) for day in range(30)]
    (drift,) = find_drifts(row)
    assert drift.drifts and drift.before == pytest.approx(1.065)


def test_a_score_counts_standard_deviations_of_a_median(find_drifts: FindDrifts) -> None:
    """From the steps' median: 1.4826 of it is their deviation, by a root of 2 that of a value."""
    row = [1.0, 1.02] * 14 + [1.2, 1.2]
    (drift,) = find_drifts(("m/a", day, value) for day, value in enumerate(row))
    assert drift.score == pytest.approx((1.2 - 1.01) / (1.4826 * 0.02 / math.sqrt(2.0)))


def test_a_figure_that_hardly_changes_has_half_a_percent_of_noise(find_drifts: FindDrifts) -> None:
    """Else the least change of one that is always the same would be the worst of all."""
    row = [2.0] * 28 + [2.04, 2.04]
    (drift,) = find_drifts(("m/a", day, value) for day, value in enumerate(row))
    assert drift.score == pytest.approx(0.02 / 0.005) and not drift.drifts


def test_too_short_a_past_says_nothing(find_drifts: FindDrifts) -> None:
    """Nor does a figure that has no size."""
    assert find_drifts([("m/a", day, 1.0) for day in range(5)]) == []
    assert find_drifts([("m/a", day, 0.0) for day in range(30)]) == []


def test_the_cell_whose_robot_lags_more_is_named_by_the_word(tmp_path: Path) -> None:
    """``./cell farm drift``, out of the cycles of twenty cells over eight days."""
    chance, now = random.Random(1), time.time()
    levels = [chance.uniform(0.08, 0.12) for _ in range(20)]
    told = []
    for number, (ago, k) in enumerate((ago, k) for ago in range(9, 1, -1) for k in range(20)):
        lag = levels[k] * chance.gauss(1.0, 0.01) * (1.6 if k == 13 and ago <= 3 else 1.0)
        end = now - 86400.0 * ago
        body = {"start": end - 9.0, "end": end, "outcome": "done", "program": "MILK"}
        cycle = Event(
            number, end, "cycle", False, "", {**body, "leader": "real", "follower_lag_s": lag}
        )
        told.append(Kept(CellName("site", "m", f"cell_{k:02d}"), 0, cycle))
    with History(tmp_path / "events", 4, 16.0) as history:
        history.write(told)
    done = CliRunner().invoke(app, ["drift", "--since", "30d", "--folder", str(tmp_path)])
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert lines[-1].startswith("1 of 20 figures go away")
    assert lines[1].startswith("m/cell_13") and FIGURE in lines[1]
