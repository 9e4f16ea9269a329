"""Random programs, half of them with a planted harm: none is missed, hardly any refused wrongly."""

from __future__ import annotations

import pytest
from harness.second_world.campaign import benches, run
from harness.second_world.planting import HARMS
from harness.yaml_files import CONFIG


@pytest.mark.thorough
@pytest.mark.parametrize(("count", "seed"), [(12, 3), (1000, 29)])
def test_planted_harm_is_refused_and_a_free_program_is_not(count: int, seed: int) -> None:
    """What is true is found by MuJoCo. The goals are 0 missed and at most 1 % refused wrongly."""
    with benches(CONFIG, seed) as known:
        found = run(count, known)
    words = "\n".join(found.wrong)
    assert min(found.planted.values()) >= count // (2 * len(HARMS))
    assert sum(found.missed.values()) == 0, words
    assert found.refused <= 0.01 * found.free, words
