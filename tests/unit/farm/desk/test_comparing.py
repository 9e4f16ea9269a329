"""Cells and weeks compared out of the history's files, as people ask."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from farm.desk.command_line_io import app
from farm.desk.figures_io import compare_cells
from farm.desk.history_io import History, Kept
from farm.desk.lines import comparing_io as comparing
from farm.desk.reading_io import AskingError
from farm.keys import CellName
from typer.testing import CliRunner

from bench.synthetic.invented import Invented

HOUR = 3600.0
EVENTS = 14 * 24


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a desk's data: two weeks of three cells, the third of which drifts."""
    made = tmp_path_factory.mktemp("desk")
    begin = time.time() - EVENTS * HOUR
    cells = [Invented(k, begin, 1.0 / HOUR, drifts=k == 3) for k in (0, 6, 3)]
    with History(made / "events", 4, 16.0) as history:
        for cell in cells:
            events = [cell.event(number) for number in range(1, EVENTS + 1)]
            history.write([Kept(CellName("site", "m", cell.name), 0, each) for each in events])
        twin = CellName("site", "n", cells[0].name)
        history.write([Kept(twin, 0, cells[0].event(1))])
    return made


def asked(data: Path, *words: str) -> tuple[int, str]:
    """Return exit code and output of ``./cell farm compare``."""
    assert comparing.app is app
    done = CliRunner().invoke(app, ["compare", *words, "--folder", str(data)])
    return done.exit_code, done.output


def test_two_cells_are_compared(data: Path) -> None:
    """Of the same program; the one that drifts lags more."""
    code, said = asked(data, "m/made_up_000", "made_up_003", "--since", "5d")
    assert code == 0 and "m/made_up_003" in said
    (line,) = (line for line in said.splitlines() if line.startswith("lag of the robot"))
    assert line.endswith("differs")
    code, said = asked(data, "m/made_up_000", "made_up_006", "--since", "5d")
    assert code == 0 and "0 of " not in said.splitlines()[0] and "stops: PAUSE" in said


def test_two_weeks_of_a_cell_are_compared(data: Path) -> None:
    """The week before and this one."""
    code, said = asked(data, "made_up_006", "--weeks", "1", "0")
    assert code == 0 and said.count("week of") == 2
    assert asked(data, "made_up_006", "--weeks", "x", "0")[0] == 2


def test_what_cannot_be_compared_is_told(data: Path) -> None:
    """No such cell, several of the name, one alone, and no history."""
    assert asked(data, "made_up_006")[0] == 2
    for word, said in (("nobody", "is not there"), ("made_up_000", "means several")):
        code, output = asked(data, "made_up_006", word)
        assert code == 1 and said in output
    assert "name one cell" in asked(data, "all", "--weeks", "1", "0")[1]
    with pytest.raises(AskingError, match="no cell is there"):
        compare_cells(data / "nowhere", ("a", "b"), 0.0, 1.0)
