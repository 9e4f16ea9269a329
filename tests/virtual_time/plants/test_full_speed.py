"""The article's own program when its speed is set to the joints' largest."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import pytest
from harness.plants.variants import FIELD, IDEAL, Variant
from harness.programs import program_of, steps_of
from harness.running.thorough import thorough
from harness.scenes.troubled import TroubledCell
from harness.virtual_cell.experiments import run_experiments
from harness.virtual_cell.files import CellFiles
from scara_config.programs.steps import MoveStep

PATH_PERCENT = 2.5
"""Of reach."""


@pytest.mark.parametrize("variant", [*thorough(IDEAL), FIELD], ids=["ideal", "field"])
@pytest.mark.parametrize("speed_percent", [*thorough(60.0), 100.0])
def test_program_that_heads_for_the_table_is_slowed_and_not_stopped(
    variant: Variant, speed_percent: float
) -> None:
    """P1 is 2 mm above a keep-out zone; the slower robot's override takes effect later, too."""
    files = faster(variant.files("fanuc_sr6ia"), speed_percent)
    with TroubledCell(files, clock_jitter=variant.clock_jitter, seed=1) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.5)
        result = run_experiments(cell, ["real_leads"])["real_leads"]
        assert result.comparison is not None, result.reasons
        error = 100.0 * result.comparison.path.max_mm / files.robot.reach_mm
    assert error <= PATH_PERCENT


def faster(files: CellFiles, speed_percent: float) -> CellFiles:
    """Return a cell whose program ARTICLE asks for another speed."""
    number = files.program_number("ARTICLE")
    steps = [
        msgspec.structs.replace(step, speed_percent=speed_percent)
        if isinstance(step, MoveStep)
        else step
        for step in steps_of(files.programs[number])
    ]
    return replace(files, programs=files.programs | {number: program_of("ARTICLE", steps)})
