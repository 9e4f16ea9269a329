"""Before zones as in test_zones.py, with SCARAs of any size."""

from __future__ import annotations

from collections import Counter

import pytest
from harness.any_scara import MADE, any_size, made_scara
from harness.virtual_cell.files import load_files
from harness.zones.moves import ZoneCell, wrong_moves

MOVES = 20


@pytest.mark.thorough
@pytest.mark.parametrize("plant", ["ideal", "field"])
@pytest.mark.parametrize("seed", range(20))
def test_a_made_scara_enters_no_zone(seed: int, plant: str) -> None:
    """Of any size, three or four axes, its quill counted up or down; nobody measured its delay."""
    counts: Counter[str] = Counter()
    with made_scara(seed) as folder, ZoneCell(seed, load_files(MADE, folder, plant)) as cell:
        wrong = wrong_moves(cell, MOVES, counts)
    print(f"{any_size(seed)}, {plant}: {dict(counts)}")
    assert not wrong, wrong
