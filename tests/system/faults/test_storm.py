"""Random commands on every interface and random faults, judged from the truth of both sides.

Each seed plays the same deeds each time; ./cell bench --storm plays many, and repeats one scene.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.faults.fault_cell import SET_UPS, FaultCell
from harness.faults.rows import Row, check
from harness.running.thorough import SEARCH, thorough
from harness.storm.crew import Crew, crew
from harness.storm.scenes import DAY
from harness.storm.storm import scenes, summed

SECONDS = 30.0 if SEARCH else 12.0
pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def storm_crew(fault_cell: FaultCell) -> Iterator[Crew]:
    """Give the cell with all its nodes and every door open."""
    fault_cell.recover()
    with crew(fault_cell) as made:
        yield made


@pytest.mark.parametrize(
    ("seed", "set_up"), [(DAY, SET_UPS[3]), *thorough(*zip((1, 2, 3, 4), SET_UPS))]
)
def test_storm_breaks_no_rule(storm_crew: Crew, seed: int, set_up: str) -> None:
    """Stops hold, limits hold, one leads, the pair is IDLE again, and no node dies."""
    storm_crew.cell.set_up(set_up)

    def played() -> list[Row]:
        found = list(scenes(storm_crew, seed, SECONDS))
        print("\n".join(scene.text() for scene in found if scene.violations))
        return summed([row for scene in found for row in scene.rows()])

    check(played)
