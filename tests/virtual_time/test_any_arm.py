"""An arm from a URDF drives the demo's experiments as it was made, without an edit."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from harness.running.thorough import thorough
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.experiments import figures, run_experiments
from harness.virtual_cell.files import load_files
from harness.workspace import ROOT
from robot_doctor.new_arm_io import make_arm

PERCENT = {"real_leads": 1.2, "twin_leads": 2.0}
"""Of reach, as of SCARAs that the doctor makes."""


@pytest.mark.parametrize(
    ("source", "plant"),
    thorough(*((s, p) for s in ("articulated_six", "scara_cell") for p in ("ideal", "field"))),
)
def test_a_made_arm_and_its_twin_keep_together(
    source: str, plant: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six axes, and a SCARA before a turntable, both known by their URDF alone."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    urdf = ROOT / "src" / "scara_description" / "urdf" / f"{source}.urdf"
    make_arm(tmp_path / "config", "made", urdf, None, tmp_path)
    with VirtualCell(load_files("made", tmp_path / "config", plant)) as cell:
        cell.connect()
        results = run_experiments(cell, tuple(PERCENT))
    for name, result in results.items():
        assert not result.reasons, result.reasons
        percent = 100.0 * figures(result).path_max_mm / cell.files.robot.reach_mm
        print(source, plant, name, f"{percent:.3f} % of reach")
        assert percent <= PERCENT[name], (name, percent)
