"""Noise and rough stamps move nobody: no false leaders, no false stops, no pauses."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import pytest
from harness.plants.variants import FIELD, IDEAL, Variant
from harness.scenes.troubled import TroubledCell
from twin_controller.config import with_links

ROBOT = "fanuc_sr6ia"
NOISE_DEG = 0.01
"""Gaussian, rms, of all joints; as much in mm."""
JITTER_S = 5e-3
"""Each stamp of either side is wrong by up to this."""
SPEED_PERCENT = 50.0
PROGRAM = "ARTICLE"


def noisy(plant: Variant) -> TroubledCell:
    """Return a connected cell with a noisy robot and rough stamps on both sides."""
    files = plant.files(ROBOT)
    measuring = msgspec.structs.replace(
        files.emulator.plant.measuring, noise_deg=NOISE_DEG, noise_mm=NOISE_DEG
    )
    made = msgspec.structs.replace(files.emulator.plant, measuring=measuring)
    files = replace(
        files,
        emulator=msgspec.structs.replace(files.emulator, plant=made),
        controller=with_links(files.controller, "desk"),
    )
    cell = TroubledCell(files, clock_jitter=JITTER_S, seed=3)
    cell.connect()
    cell.real.robot.write_override(100)
    cell.schedule.run(1.0)
    return cell


@pytest.mark.thorough
@pytest.mark.parametrize(("seconds", "rounds"), [(6.0, 1), (600.0, 50)])
@pytest.mark.parametrize("plant", [IDEAL, FIELD], ids=["ideal", "field"])
def test_each_motion_of_a_noisy_pair_has_its_true_leader(
    plant: Variant, seconds: float, rounds: int
) -> None:
    """At rest nobody is taken for a leader, and no alarm comes.

    Then a move of the twin and a program of the robot by turns, and nothing else is decided. Each
    time core/test_arbitration.py holds that noise and wrong clocks make nobody lead.
    """
    with noisy(plant) as cell:
        decided = len(cell.decisions)
        cell.schedule.run(seconds)
        assert cell.mode == "IDLE" and cell.decisions[decided:] == []
        places = [cell.files.robot.positions_m[name] for name in ("P2", "P1")]
        cell.run_program(PROGRAM, SPEED_PERCENT)
        cell.wait_still(0.3)
        decided = len(cell.decisions)
        for _ in range(rounds):
            for place in places:
                cell.move_to(place, SPEED_PERCENT)
                cell.wait_still(0.3)
            cell.run_program(PROGRAM, SPEED_PERCENT)
            cell.wait_still(0.3)
        found = [(each.trigger, each.mode_after) for each in cell.decisions[decided:]]
        twin, real = ("TWIN_MOVED", "TWIN_LEADS"), ("REAL_TOOK_OVER", "REAL_LEADS")
        rest = ("AT_REST", "IDLE")
        assert found == [twin, rest, twin, rest, real, rest] * rounds
