"""A desk and two machines behind slow lines, in network namespaces; one line is cut for a while."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.machines.cut_farm import CELLS, cut_for
from harness.machines.namespaces import missing

pytestmark = [pytest.mark.system, pytest.mark.thorough]
CUT_S = 20.0


@pytest.mark.skipif(bool(missing()), reason=f"network namespaces: {missing()}")
def test_a_machine_that_was_cut_off_loses_nothing(tmp_path: Path) -> None:
    """With 20 ms and 1 % loss both ways: each event once; it is seen lost, found, and obeys."""
    seen = cut_for(CUT_S, tmp_path, print)
    assert (seen.missing, seen.doubled) == (0, 0) and seen.expected > 0
    assert seen.stopped == 2 * CELLS
    assert seen.lost_s < CUT_S
