"""The fault scenarios notice what has not happened, here in a cell of stand-ins."""

from __future__ import annotations

import math
import time
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
from harness.faults import operator_faults
from harness.faults.link_faults import disturbed
from harness.faults.operator_faults import STOPS, noisy, stop_reaches_both
from harness.faults.rows import Row, worst
from harness.wires.damage import Delayed, Sometimes

NOTHING: dict[str, float] = {}


def cell(*reports: dict[str, float]) -> Any:
    """Return a cell that stands still, whose wires to robot and twin have noted this."""
    modbus, web = (
        SimpleNamespace(disturb=lambda fault: None, report=lambda noted=noted: noted)
        for noted in reports
    )
    side = SimpleNamespace(standstill=lambda since: 0.1, travel=lambda begin: 0.0)
    return SimpleNamespace(
        modbus=modbus,
        web=web,
        real=side,
        twin=side,
        recover=lambda: None,
        go=lambda percent: None,
        noticed=lambda since, events: since,
        decided=lambda since: [],
    )


def broken(rows: list[Row]) -> dict[str, float]:
    """Return what does not hold."""
    return {row.metric: row.measured for row in rows if not row.holds}


def test_a_stop_that_never_comes_on_a_wire_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody waits for it in vain and plays again: it is counted, and may never happen."""
    monkeypatch.setattr(operator_faults, "_stop", lambda cell, source: None)
    monkeypatch.setattr(operator_faults, "ON_WIRE_S", 0.0)
    seen = {"seen": time.time() + 60.0}
    for real, twin in ((NOTHING, seen), (seen, NOTHING)):
        rows = stop_reaches_both(cell(real, twin), Random(1), 1)
        assert broken(rows)["lost"] == len(STOPS)
        assert all(row.always for row in rows if row.metric == "lost")
    assert "lost" not in broken(stop_reaches_both(cell(seen, seen), Random(1), 1))


@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_line_on_which_nothing_is_damaged_proves_nothing(side: str) -> None:
    """One that is only slow has nothing to damage."""
    fault = Sometimes(Random(1), 0.02)
    assert broken(disturbed(cell({}, {}), side, "damaged", fault, 0.0)) == {"units damaged": 0.0}
    assert not broken(disturbed(cell({}, {}), side, "slow", Delayed(0.01), 0.0))
    struck = {"drop": 3.0}
    assert not broken(disturbed(cell(struck, struck), side, "damaged", fault, 0.0))


def test_noise_that_reaches_one_wire_only_proves_nothing() -> None:
    """Both sides are noisy."""
    on, name = {"noisy": 3.0}, "noisy units on the wire with fewer"
    for real, twin in ((NOTHING, on), (on, NOTHING)):
        assert broken(noisy(cell(real, twin), Random(1), 0.0)) == {name: 0.0}
    assert not broken(noisy(cell(on, on), Random(1), 0.0))


def test_a_figure_that_is_none_is_the_worst() -> None:
    """Before or behind a good one."""
    good, none = (Row("cut", "found after [s]", 0.1, value) for value in (0.05, math.nan))
    for rows in ([good, none], [none, good]):
        assert worst(rows) == [none]
