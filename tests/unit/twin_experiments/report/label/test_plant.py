"""The plant of a recording, from the text that the stand-in published."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fanuc_emulator.plant.config import load_plant, plant_text
from scara_config import load_robot
from twin_experiments.report.label.plant import RecordedPlant, parse_plant, plant_label

CONFIG = Path(__file__).resolve().parents[5] / "config"
SOFT = {"name": "soft", "description": "a soft robot", "payload_kg": 1.5}


def test_a_plant_is_read_and_what_a_report_does_not_need_is_ignored() -> None:
    """A stand-in may say more than the report knows."""
    plant = parse_plant(json.dumps({**SOFT, "colour": "yellow", "clock": {"drift_ppm": 21.0}}))
    assert plant == RecordedPlant("soft", "a soft robot", 1.5)
    assert plant_label(plant) == "soft: a soft robot"
    assert plant_label(None) == "not recorded"


@pytest.mark.parametrize("robot", ["fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six"])
@pytest.mark.parametrize("name", ["ideal", "field"])
def test_what_the_stand_in_says_is_understood(
    robot: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every shipped plant of every robot, as the stand-in publishes it."""
    monkeypatch.setenv("SCARA_ROBOT", robot)
    written = load_plant(load_robot(CONFIG), CONFIG, name)
    read = parse_plant(plant_text(name, written))
    assert (read.name, read.description) == (name, written.description)
    assert (read.geometry is None) == (written.geometry is None)
    if read.geometry is not None and written.geometry is not None:
        assert read.geometry.screw_axes == written.geometry.screw_axes
        assert read.geometry.home_pose == written.geometry.home_pose
    for joint, axis in written.axes.items():
        assert read.axes[joint].zero_offset_deg == axis.zero_offset_deg
        assert read.axes[joint].zero_offset_mm == axis.zero_offset_mm
