"""A robot that repeats its program is followed by what it did before."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial

import pytest
from harness.plants.variants import FIELD, IDEAL, Variant
from harness.scenes.copies import copied
from harness.scenes.troubled import TroubledCell
from harness.virtual_cell.experiments import run_experiments
from twin_controller.config import with_links
from twin_controller.core.actions import FollowTwin

ROBOT = "fanuc_sr6ia"
FAST = 3.0
"""Some joint's speed in the middle of a move [rad/s]."""


@dataclass(frozen=True)
class Round:
    """One round of the article's program: path error, and how often the way on was foretold."""

    path_percent: float
    foretold: int


class Rounds:
    """A cell whose robot runs the article's program again and again."""

    def __init__(self, plant: Variant) -> None:
        """Connect; a late process of ours is no lost link."""
        files = plant.files(ROBOT)
        files = replace(files, controller=with_links(files.controller, "desk"))
        self.cell = TroubledCell(files, seed=1)
        self.cell.connect()
        self.cell.real.robot.write_override(100)
        self.cell.schedule.run(0.5)
        self._foretold, take = 0, self.cell.twin.follow

        def counted(action: FollowTwin) -> None:
            self._foretold += len(action.points) > 1
            take(action)

        self.cell.twin.follow = counted  # type: ignore[method-assign]

    def run(self, pause_s: float = 0.0) -> Round:
        """Run one round; in the middle of each of its moves the controller may stand still."""
        before = self._foretold
        if pause_s:
            self._watch(pause_s, ready=True)
        found = run_experiments(self.cell, ["real_leads"])["real_leads"].comparison
        assert found is not None
        percent = 100.0 * found.path.max_mm / self.cell.files.robot.reach_mm
        self.cell.schedule.run(1.0)
        return Round(percent, self._foretold - before)

    def _watch(self, pause_s: float, ready: bool) -> None:
        """Let the controller stand still once in each move, when the robot is fast."""
        fast = max(map(abs, self.cell.real.shown.velocities)) > FAST
        if fast and ready:
            self.cell.stand_controller(pause_s)
        self.cell.schedule.after(0.01, lambda: self._watch(pause_s, not fast))


@cache
def told(plant: Variant, pause_s: float) -> dict[str, Round]:
    """Return two rounds; with pauses both once more: each on a copy of the cell before it."""
    rounds, found = Rounds(plant), {}
    paused = partial(copied, partial(rounds.run, pause_s), Round)
    with rounds.cell:
        for calm, disturbed in (("first", "blind"), ("second", "disturbed")):
            if pause_s:
                found[disturbed] = paused()
            found[calm] = rounds.run()
    return found


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("plant", "limit", "part"), [(IDEAL, 0.2, 0.95), (FIELD, 0.5, 0.85)], ids=["ideal", "field"]
)
def test_the_second_round_is_followed_closer(plant: Variant, limit: float, part: float) -> None:
    """In the first one only the program's second visits of its stands are foretold.

    Of the ideal plant little is left to be gained: its jerk is followed in the first round too.
    """
    found = told(plant, 0.0)
    first, second = found["first"], found["second"]
    assert second.foretold > first.foretold + 20, (first, second)
    assert second.path_percent <= min(limit, part * first.path_percent), (first, second)
