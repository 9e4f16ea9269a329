"""The table of the farm, and which parts there are."""

from __future__ import annotations

import inspect

from bench import farm
from bench.__main__ import main
from bench.many_cells.table import farm_table
from bench.second_world.figure import Figure

PART = {
    "part": "stop",
    "seconds": 20.4,
    "date": "2026-11-23",
    "commit": "abc1234",
    "machine": "a machine",
    "load_before": 0.12,
    "figures": [Figure("STOP", "ms", 50.0, 12.34, note="p99 of 1000").record()],
}


def test_the_table_says_what_was_measured_and_how_to_do_it_again() -> None:
    """Each part with its own date, machine and commit."""
    lines = farm_table([PART])
    assert lines[0] == "## The farm" and "| STOP | 12.3 ms | ≤ 50 ms | yes | p99 of 1000 |" in lines
    assert any("`./cell bench --farm stop`: 2026-11-23, commit abc1234" in line for line in lines)


def test_each_part_can_be_asked_for_by_its_name() -> None:
    """The help names them all."""
    told = str(inspect.signature(main).parameters["farm"].annotation)
    assert " ".join(farm.PARTS) in told.replace('" "', "").replace("' '", "")
