"""What got worse since the last measurement, and what only varies."""

from __future__ import annotations

import os
import sys
import time
from typing import Any

import pytest
from harness.workspace import ROOT

if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from bench import run
from bench.cells.whole_cell import _waits
from bench.compare import not_compared, worse
from bench.record import Beside, Goal, Record
from bench.rows import pauses

LESS, MORE = Goal("ours", 10.0), Goal("ours", 1.0, at_least=True)


def row(ours: float | None, baseline: float | None = None, **fields: Any) -> dict[str, Any]:
    """Return a row as results.json holds it, of one machine unless said otherwise."""
    machine = fields.pop("machine", "one")
    goals = fields.pop("goals", (LESS,))
    record = Record("row", ours, baseline, "ms", goals, **fields)
    return {**record.document(), "machine": machine}


@pytest.mark.parametrize(
    ("before", "now", "said"),
    [
        (row(1.0), row(1.15), []),
        (row(1.0), row(1.3), ["row: ours 1 -> 1.3 ms, the rounds lie 20 % apart"]),
        (row(1.0), row(0.1), []),
        (row(1.0, spread_percent=60.0), row(1.3), []),
        (row(1.0), row(1.3, spread_percent=60.0), []),
        (row(5.0, goals=(MORE,)), row(3.0, goals=(MORE,)), ["row: ours 5 -> 3 ms"]),
        (row(5.0, goals=(MORE,)), row(9.0, goals=(MORE,)), []),
        (row(9.0), row(10.5), ["row: held its goals before, and does not now"]),
        (row(1.0), row(None, note="not measured: cut"), ["row: not measured any more: not"]),
        (row(None), row(1.0), []),
        (row(1.0), row(5.0, machine="another"), []),
        (row(1.0, 1.0), row(5.0, 4.9, machine="another"), []),
        (row(1.0, 1.0), row(2.0, 1.0, machine="another"), ["row: ratio 1 -> 2, the rounds lie 20"]),
    ],
)
def test_a_figure_got_worse_if_it_did_by_more_than_the_rounds_lie_apart(
    before: dict[str, Any], now: dict[str, Any], said: list[str]
) -> None:
    """Ratios count on any machine, figures of our own on the same one."""
    found = worse([before], [now])
    assert len(found) == len(said), found
    assert all(text.startswith(begin) for text, begin in zip(found, said)), found


def test_figures_beside_count_if_they_have_a_goal() -> None:
    """The others only explain."""
    beside = lambda value: (  # noqa: E731
        Beside("at rest", value, "%", "<= 90", value <= 90.0),
        Beside("of a node", value, "%"),
    )
    found = worse([row(1.0, beside=beside(30.0))], [row(1.0, beside=beside(60.0))])
    assert found == ["row: at rest 30 -> 60 %, the rounds lie 20 % apart"]


def test_what_cannot_be_compared_is_named() -> None:
    """A new row, and a figure of another machine without a baseline."""
    assert not_compared([], [row(1.0)]) == ["row"]
    assert not_compared([row(1.0)], [row(1.0, machine="another")]) == ["row"]
    assert not_compared([row(1.0, 2.0)], [row(1.0, 2.0, machine="another")]) == []
    assert not_compared([row(1.0)], [row(2.0)]) == []


def test_the_end_of_a_bench_says_what_got_worse_or_that_nothing_did() -> None:
    """One line for each figure, and one that says how many were compared."""
    assert run.since_last([row(1.0)], [row(1.0)]) == [
        "none of 1 rows got worse by more than its rounds lie apart"
    ]
    assert run.since_last([row(1.0)], [row(2.0)]) == [
        "worse than the last time: row: ours 1 -> 2 ms, the rounds lie 20 % apart"
    ]
    assert run.since_last([], [row(2.0)])[-1] == (
        "not compared, new or measured on another machine: row"
    )


def test_wakes_are_counted_for_each_thread() -> None:
    """A thread that sleeps forty times has waited so often, but where it came late to a sleep."""
    before = _waits(os.getpid())
    for _ in range(40):
        time.sleep(0.002)
    after = _waits(os.getpid())
    here = str(os.getpid())
    assert after[here] - before[here] >= 20


@pytest.mark.parametrize(("grows", "holds"), [(0.0, True), (10.0, False)])
def test_a_pause_row_takes_the_worst_phase_and_compares_with_none(
    monkeypatch: pytest.MonkeyPatch, grows: float, holds: bool
) -> None:
    """A pause costs most at one part of the motion; there it counts."""

    class Quiet:
        def say(self, text: str) -> None:
            """Say nothing."""

    def error(leader: str, variant: Any) -> float:
        length = sum(variant.pauses)
        return float(0.2 + grows * length * variant.first_pause)

    monkeypatch.setattr(pauses, "_error", error)
    found = pauses.pause_twin_leads(Quiet())  # type: ignore[arg-type]
    assert found.ours == pytest.approx(0.2 + grows * 0.05 * max(pauses.PHASES_S))
    assert found.baseline == 0.2 and found.holds is holds
    assert found.beside[0].value == pytest.approx(0.2 + grows * 0.02 * max(pauses.PHASES_S))
