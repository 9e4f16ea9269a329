"""Each night what was fitted is kept, and the cell whose joint wears is named; no other is."""

from __future__ import annotations

import json
import os
import random
import sys
from datetime import date, timedelta
from pathlib import Path

import pytest
from farm.desk.command_line_io import app as farm_app
from farm.desk.commands_io import cells_there
from farm.desk.fetching_io import fetch, recordings_of
from farm.desk.fits_io import FITS, keep_fits, read_fits
from farm.desk.lines import key_figures_io as key_figures
from farm.desk.reading_io import AskingError
from farm.fits import DayFit, chosen, noon_of
from farm.lab.command_line_io import app
from harness.processes import wait_until
from typer.testing import CliRunner
from unit.farm.conftest import CELL, Farm, Journal

CELLS, NIGHTS = 8, 8
WORN, JOINT = 5, "joint_2"
LEVELS = {"joint_1": 1.0, "joint_2": 0.5, "joint_3": 5.0}
FIT = f"""#!{sys.executable}
import json, pathlib, sys
said = json.loads(pathlib.Path(sys.argv[1]).read_text())
if "why" in said:
    sys.exit(said["why"])
units = {{"joint_1": "N m", "joint_2": "N m", "joint_3": "N"}}
print(json.dumps({{"friction": said["friction"], "units": units, "rms_mm": [1.0, 0.5]}}))
"""


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a project whose fit reads the friction out of the recording."""
    program = tmp_path / "devel" / "lib" / "twin_analysis" / "fit_twin"
    program.parent.mkdir(parents=True)
    program.write_text(FIT)
    program.chmod(0o755)
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    return tmp_path


def record(root: Path, cell: str, day: date, content: object, name: str = "run.bag") -> None:
    """Let the desk have fetched a recording of a day."""
    bag = root / "runs" / "farm" / "recordings" / "m" / cell / day.isoformat() / name
    bag.parent.mkdir(parents=True, exist_ok=True)
    bag.write_text(json.dumps(content))
    os.utime(bag, (noon_of(day.isoformat()),) * 2)


def night(day: date) -> tuple[int, str]:
    """Return exit code and output of ``./cell lab nightly``."""
    done = CliRunner().invoke(app, ["nightly", "--day", day.isoformat(), "--no-fetch"])
    return done.exit_code, done.output


def test_the_cell_whose_joint_wears_is_named_and_no_other(root: Path) -> None:
    """Cells that differ from each other, fits that differ from night to night by 3 %."""
    chance, today = random.Random(1), date.today()
    own = [{joint: chance.uniform(0.8, 1.2) for joint in LEVELS} for _ in range(CELLS)]
    for night_ago in range(NIGHTS, 0, -1):
        day = today - timedelta(days=night_ago)
        for k in range(CELLS):
            friction = {
                joint: size * own[k][joint] * chance.gauss(1.0, 0.03)
                for joint, size in LEVELS.items()
            }
            if k == WORN and night_ago <= 2:
                friction[JOINT] *= 1.6
            record(root, f"cell_{k:02d}", day, {"friction": friction})
        code, said = night(day)
        assert code == 0 and f"{CELLS} cells, {CELLS} recordings fitted" in said
    assert key_figures.app is farm_app
    words = ["drift", "--since", "30d", "--folder", str(root / "runs" / "farm")]
    done = CliRunner().invoke(farm_app, words)
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert f"1 of {4 * CELLS} figures go away" in lines[-1]
    assert lines[1].startswith(f"m/cell_{WORN:02d}") and "fitted friction joint_2 [N m]" in lines[1]


def test_a_recording_that_says_nothing_is_left_out_and_told(root: Path) -> None:
    """The medians of the others count; those of another day are not looked at."""
    day = date(2026, 11, 20)
    for k, friction in enumerate((0.4, 0.6)):
        record(root, "a", day, {"friction": {"joint_2": friction}}, f"{k}.bag")
    record(root, "b", day, {"why": "no joint of the arm moved in this recording"})
    record(root, "c", day + timedelta(days=1), {"friction": {"joint_2": 9.0}})
    code, said = night(day)
    assert code == 0 and "1 cells, 2 recordings fitted" in said
    assert "b/2026-11-20/run.bag: left out: ended with 1: no joint of the arm moved" in said
    at = noon_of("2026-11-20")
    kept = list(read_fits(root / "runs" / "farm", at, at))
    figures = {"error before the fit [mm]": 1.0, "fitted friction joint_2 [N m]": 0.5}
    assert kept == [DayFit("m", "a", "2026-11-20", 2, figures)]
    assert night(date(2026, 11, 1))[0] == 1
    assert CliRunner().invoke(app, ["nightly", "--day", "monday"]).exit_code == 2


def test_the_newest_of_a_day_are_fitted_and_none_that_is_too_long() -> None:
    """So that a night has an end."""
    noon = noon_of("2026-11-20")
    listed = {"a": (noon, 5), "b": (noon + 60.0, 50), "c": (noon + 30.0, 5), "d": (noon + 9.0, 5)}
    assert chosen(listed, date(2026, 11, 20), None, 2, 10) == ["c", "d"]
    assert chosen(listed, date(2026, 11, 21), None, 2, 10) == []


def test_a_file_of_fits_that_is_none_is_told(tmp_path: Path) -> None:
    """With what to do; what is being written does not count."""
    keep_fits(tmp_path, "2026-11-20", [DayFit("m", "a", "2026-11-20", 1, {})])
    (tmp_path / FITS / "2026-11-21.part").write_text("{")
    at = noon_of("2026-11-20")
    assert len(list(read_fits(tmp_path, at, at + 86400.0))) == 1
    (tmp_path / FITS / "2026-11-21.jsonl").write_text("{")
    with pytest.raises(AskingError, match="is no file of fits"):
        list(read_fits(tmp_path, at, at + 86400.0))


def test_a_fetched_recording_has_the_cells_time_of_it(farm: Farm, tmp_path: Path) -> None:
    """By it the night knows of which day it is."""
    runs = tmp_path / "runs"
    runs.mkdir()
    (runs / "run.bag").write_bytes(b"x" * 1000)
    os.utime(runs / "run.bag", ns=(1_700_000_000_000_000_000,) * 2)
    session = farm.router()
    farm.link(farm.client(), Journal(), runs=runs)
    wait_until(lambda: bool(cells_there(session, "site", 1.0)), 10.0, "the cell")
    (recording,) = recordings_of(session, CELL)
    fetch(session, CELL, recording, tmp_path / "fetched.bag")
    assert (tmp_path / "fetched.bag").stat().st_mtime_ns == recording.modified
