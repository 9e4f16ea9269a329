"""A SCARA from three numbers drives the demo's experiments as it was made, without an edit.

20 of them by night, on one plant and the other in turn. Each time
robot_doctor/test_new_scara.py holds their files, and test_kit_robot.py both experiments.
"""

from __future__ import annotations

import shutil
from itertools import cycle
from pathlib import Path

import pytest
from harness.any_scara import any_size
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.experiments import figures, run_experiments
from harness.virtual_cell.files import load_files
from harness.workspace import ROOT
from robot_doctor.new_profile_io import make_scara

MADE = range(20)
PERCENT = {"real_leads": 1.2, "twin_leads": 2.0}
"""Of reach, as a robot of typed programs keeps them."""


@pytest.mark.thorough
@pytest.mark.parametrize(("seed", "plant"), list(zip(MADE, cycle(("ideal", "field")))))
def test_a_made_scara_and_its_twin_keep_together(
    seed: int, plant: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the files as the doctor made them."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    make_scara(tmp_path / "config", "made", any_size(seed), tmp_path)
    with VirtualCell(load_files("made", tmp_path / "config", plant)) as cell:
        cell.connect()
        results = run_experiments(cell)
    assert set(results) == set(PERCENT)
    for name, result in results.items():
        assert not result.reasons, (any_size(seed), result.reasons)
        percent = 100.0 * figures(result).path_max_mm / cell.files.robot.reach_mm
        print(seed, plant, any_size(seed), name, f"{percent:.3f} % of reach")
        assert percent <= PERCENT[name], (any_size(seed), name, percent)
