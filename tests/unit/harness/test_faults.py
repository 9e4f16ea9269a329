"""The fault scenarios notice what has not happened, here in a cell of stand-ins."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest
from harness.faults import link_faults, operator_faults
from harness.faults.link_faults import NOT_ANSWERED, both_stand, disturbed, give_stop
from harness.faults.operator_faults import STOPS, noisy, stop_reaches_both
from harness.faults.person_faults import stays_refused
from harness.faults.rows import Row, repeated, worst
from harness.processes import wait_until
from harness.running.repeats import Notes
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


@pytest.mark.parametrize(
    ("why", "becomes"),
    [
        ("", "lost"),
        ("real: this machine stood still for 0.11 s: no fresh data for 100 ms", "asked again"),
        ("real: the robot did not answer in time", "a failure that a standstill may excuse"),
    ],
)
def test_a_stop_that_nobody_decided_is_lost_unless_a_link_was(
    monkeypatch: pytest.MonkeyPatch, why: str, becomes: str
) -> None:
    """A lost link ends the motion too: behind it there is nothing to stop."""
    monkeypatch.setattr(operator_faults, "_stop", lambda cell, source: None)
    monkeypatch.setattr(operator_faults, "NOTES", Notes())  # not of this run
    asked: list[str] = []

    def noticed(since: float, events: tuple[str, ...]) -> float:
        asked.extend(events)
        assert len(asked) > 1, "waited in vain"
        return since

    lost = SimpleNamespace(event="LINK_LOST", mode_after="OFFLINE", why=why)
    lost.header = SimpleNamespace(stamp=SimpleNamespace(to_sec=lambda: time.time() + 1.0))
    pair = cell(seen := {"seen": time.time() + 60.0}, seen)
    pair.noticed, pair.decided = noticed, lambda since: [lost] if why else []
    if becomes == "a failure that a standstill may excuse":
        with pytest.raises(AssertionError, match="behind the stop: real: the robot did not"):
            stop_reaches_both(pair, Random(1), 1)
        return
    assert broken(stop_reaches_both(pair, Random(1), 1)).get("lost") == (
        1.0 if becomes == "lost" else None
    )
    assert len(asked) == len(STOPS) + (becomes == "asked again")


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


def plays(scene: Callable[[], object]) -> int:
    """Return how often a scene that fails is played on a machine that stood still."""
    played: list[int] = []

    def measure() -> list[Row]:
        played.append(1)
        scene()
        return []

    looks = SimpleNamespace(now=lambda: 0.0, stood_still=lambda since: 0.045)
    with pytest.raises(AssertionError):
        repeated(measure, looks=looks)
    return len(played)


def answering(message: str, success: bool = False, sent: bool = False) -> Any:
    """Return a cell whose twin controller answers so."""
    answer = SimpleNamespace(message=message, success=success, sent=sent)
    return SimpleNamespace(command=lambda command: answer)


@pytest.mark.parametrize(
    ("answer", "times"),
    [
        (answering("later"), 1),
        (answering("sent: STOPPED; but the twin is not seen to stand", sent=True), 3),
        (answering(NOT_ANSWERED), 3),
    ],
    ids=["refused", "seen late", "answered late"],
)
def test_a_refused_stop_is_final_and_a_late_one_is_not(answer: Any, times: int) -> None:
    """No busy machine makes the controller refuse it."""
    assert plays(lambda: give_stop(answer, "STOP")) == times


@pytest.mark.parametrize(
    ("answer", "times"),
    [(answering("it goes on", success=True), 1), (answering("a link is down"), 3)],
    ids=["taken", "refused for another reason"],
)
def test_a_motion_that_goes_on_beside_a_person_is_final(answer: Any, times: int) -> None:
    """A machine that was late may have lost a link; it never lets RESUME pass."""
    assert plays(lambda: stays_refused(answer, "RESUME", "mm away")) == times


@pytest.mark.parametrize(("moves", "times"), [(True, 1), (False, 3)])
def test_a_robot_that_moves_on_after_a_stop_is_final_and_one_that_stood_late_is_not(
    moves: bool, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stands within seconds, however late the machine is."""
    monkeypatch.setattr(
        link_faults, "wait_until", lambda holds, timeout, what: wait_until(holds, 0.0, what)
    )
    side = SimpleNamespace(
        standstill=lambda since: math.inf if moves else 2.5,
        under_way=lambda share, duration: moves,
    )
    cell: Any = SimpleNamespace(real=side, twin=side)
    assert plays(lambda: both_stand(cell, 0.0)) == times
