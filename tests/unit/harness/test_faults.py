"""The fault scenarios notice what did not happen: on a cell of stand-ins whose wires see nothing."""

from __future__ import annotations

import time
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
from harness.faults import operator_faults
from harness.faults.operator_faults import STOPS, stop_reaches_both
from harness.faults.rows import Row


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
    for reports in (({}, seen), (seen, {})):
        rows = stop_reaches_both(cell(*reports), Random(1), 1)
        assert broken(rows)["lost"] == len(STOPS)
        assert all(row.always for row in rows if row.metric == "lost")
    assert "lost" not in broken(stop_reaches_both(cell(seen, seen), Random(1), 1))
