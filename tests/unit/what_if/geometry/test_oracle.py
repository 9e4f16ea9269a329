"""An outside oracle: MuJoCo's forward kinematics and distances on the same URDF."""

from __future__ import annotations

import os

import pytest
from harness.second_world.oracle import compare
from harness.yaml_files import CONFIG
from scara_config.profile import CHOICE
from what_if.cell_files_io import read_cell

AGREE = 0.5e-3
"""The goal: so far [m] may the two be apart."""


@pytest.mark.parametrize("robot", ["fanuc_sr6ia", "fanuc_sr3ia", "articulated_six"])
@pytest.mark.parametrize("count", [25, pytest.param(1000, marks=pytest.mark.thorough)])
def test_mujoco_finds_the_same_clearance(
    robot: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The smallest distance of all pairs that are watched, in poses all over the ranges."""
    monkeypatch.setitem(os.environ, CHOICE, robot)
    found = compare(read_cell(CONFIG), count)
    assert found.free > count // 4
    assert max(found.apart, found.deeper) <= AGREE
