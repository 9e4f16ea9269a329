"""The page's largest distance is the largest that the controller could know, however short."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from harness.plants.trials import long_moves
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.experiments import run_experiments
from harness.virtual_cell.files import load_files
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.screws import ScrewModel, tool_positions
from twin_controller.reporting.peak import Peak
from twin_controller.view import state_view
from twin_experiments.config import metrics_settings
from twin_experiments.metrics.errors import trace
from twin_experiments.metrics.series import Motion

AGREE_MM = 0.2
STATE_S, LOOK_S = 0.05, 0.001


@pytest.mark.thorough
def test_largest_distance_is_that_of_the_readings_and_not_of_twenty_states_a_second() -> None:
    """The robot leads at full speed on the field plant.

    Its readings are what the report of a real robot is made of.
    """
    files = long_moves(load_files("fanuc_sr6ia", plant="field"), 100.0)
    with VirtualCell(files) as cell:
        cell.connect()
        peak = Peak(cell.setup)
        told, stated = [0.0], [0.0]
        heard: dict[str, dict[float, JointMotion]] = {"real": {}, "twin": {}}

        def look() -> None:
            sides = cell._state.sides
            for name, side in (("real", sides.real), ("twin", sides.twin)):
                if side.history:
                    heard[name][side.last.time] = side.last
            if widest := peak.rises(cell._state):
                view = state_view(cell.setup, cell._state, cell.clock(), widest)
                told.append(view.deviation_mm)

        def state() -> None:
            view = state_view(cell.setup, cell._state, cell.clock())
            if view.leader:
                stated.append(view.deviation_mm)

        cell.schedule.every(LOOK_S, look, first=0.003)
        cell.schedule.every(STATE_S, state, first=0.002)
        run_experiments(cell, ["real_leads"])
    motions = [_motion(name, samples) for name, samples in heard.items()]
    tool = partial(tool_positions, ScrewModel.from_robot(files.robot))
    settings = metrics_settings(files.experiments.metrics, files.robot)
    seen = trace(motions[0], motions[1], tool, settings)
    largest = float(seen.deviation_mm[seen.moving].max())
    fastest = np.abs(motions[0].velocities[:, 0]).max() / files.robot.twin_joints[0].velocity
    assert 0.995 < fastest < 1.02, "a label is part of a figure"
    print(f"readings {largest:.2f} mm, told {max(told):.2f} mm, in states {max(stated):.2f} mm")
    assert abs(max(told) - largest) <= AGREE_MM
    assert max(stated) < largest - AGREE_MM, "the peak is too long to test anything"


def _motion(name: str, samples: dict[float, JointMotion]) -> Motion:
    """Return the arm's samples as a report takes them."""
    stamps = np.array(sorted(samples))
    ordered = [samples[stamp] for stamp in stamps]
    q = np.array([sample.q[:3] for sample in ordered])
    return Motion(name, stamps, q, np.array([sample.qdot[:3] for sample in ordered]))
