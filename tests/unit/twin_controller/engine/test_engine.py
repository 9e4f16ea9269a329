"""The engine's thread: who watches it, and what it does with an error."""

from __future__ import annotations

import threading
from typing import Any

import msgspec
import pytest
from harness.pair import HOME, SETUP
from harness.processes import wait_until
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Decided
from twin_controller.core.events import (
    AnyEvent,
    LinkChanged,
    RealMeasured,
    Tick,
    TwinMeasured,
    TwinMotion,
)
from twin_controller.core.lead.modes import Mode
from twin_controller.core.state import CoreState
from twin_controller.engine.engine_io import ALIVE, Engine


class Links:
    """Both links: nothing goes out."""

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None


class Listener:
    """Hangs or fails on demand when it hears of a link."""

    def __init__(self) -> None:
        self.go_on = threading.Event()
        self.go_on.set()
        self.fails = False
        self.batches: list[list[AnyEvent]] = []

    def stepped(self, events: list[AnyEvent], state: CoreState, decided: list[Decided]) -> None:
        """Hear of a batch."""
        self.batches.append(events)
        if any(isinstance(event, LinkChanged) for event in events):
            if self.fails:
                raise RuntimeError("a bug")
            self.go_on.wait(5.0)


def test_engine_that_hangs_is_not_alive() -> None:
    """Whoever beats for it must know; when it goes on it is alive again."""
    listener = Listener()
    engine = Engine(SETUP, Links(), Links(), listener.stepped)
    assert not engine.alive
    with engine:
        wait_until(lambda: engine.alive, 2.0, "a living engine")
        listener.go_on.clear()
        engine.link_changed("real", False, "cut")
        wait_until(lambda: not engine.alive, 10 * ALIVE, "an engine that hangs")
        listener.go_on.set()
        wait_until(lambda: engine.alive, 2.0, "a living engine")


def test_engine_that_dies_keeps_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bug is never swallowed: the node ends with it."""
    monkeypatch.setattr(threading, "excepthook", lambda arguments: None)
    listener = Listener()
    listener.fails = True
    with Engine(SETUP, Links(), Links(), listener.stepped) as engine:
        wait_until(lambda: engine.alive, 2.0, "a living engine")
        engine.link_changed("real", False, "cut")
        wait_until(lambda: engine.failure is not None, 10.0, "the end of the engine")
        assert isinstance(engine.failure, RuntimeError) and not engine.alive
        wait_until(lambda: not engine.running, 2.0, "the end of its thread")


class OneGap:
    """The third look came late."""

    def __init__(self, config: object) -> None:
        self.looks, self.stood = 0, 0.0

    def look(self, now: float) -> float:
        """Take one look."""
        self.looks += 1
        self.stood = 0.05 if self.looks == 3 else 0.0
        return self.stood


def test_core_hears_of_the_engines_own_gap_before_what_has_waited(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else the first input behind the gap would be judged with it."""
    monkeypatch.setattr("twin_controller.engine.engine_io.OwnGaps", OneGap)
    listener = Listener()
    with Engine(SETUP, Links(), Links(), listener.stepped) as engine:
        for _ in range(5):
            seen = len(listener.batches)
            engine.link_changed("real", False, "cut")
            wait_until(lambda seen=seen: len(listener.batches) > seen, 5.0, "a batch")
        wait_until(lambda: len(listener.batches) > 5, 5.0, "some batches")
    late = [batch for batch in listener.batches if any(_gap(event) for event in batch)]
    assert len(late) == 1 and _gap(late[0][0]) == 0.05


def test_readings_that_waited_are_overtaken_by_the_newest() -> None:
    """While the engine hangs, readings pile up; two of one instant do not overtake each other."""
    listener = Listener()
    with Engine(SETUP, Links(), Links(), listener.stepped) as engine:
        listener.go_on.clear()
        engine.link_changed("real", False, "cut")
        wait_until(lambda: any(map(_of_links, listener.batches)), 2.0, "an engine that hangs")
        for clock_ms in (10, 20, 30, 30):
            engine.put(RealMeasured(0.0, 0.0, 0.0, clock_ms, JointMotion.at_rest(HOME)))
        listener.go_on.set()
        wait_until(lambda: _readings(listener), 2.0, "the readings")
    assert [reading.overtaken for reading in _readings(listener)] == [True, True, False, False]


def test_time_passes_by_a_tick_only_where_no_input_comes() -> None:
    """Each input has a time, by which the core judges what is over; so an empty wait is a tick."""
    listener = Listener()
    with Engine(SETUP, Links(), Links(), listener.stepped) as engine:
        wait_until(lambda: any(map(_ticks, listener.batches)), 2.0, "a tick")
        listener.go_on.clear()
        engine.link_changed("real", False, "cut")
        wait_until(lambda: not engine.alive, 10 * ALIVE, "an engine that hangs for ten ticks")
        engine.put(RealMeasured(0.0, 0.0, 0.0, 10, JointMotion.at_rest(HOME)))
        listener.go_on.set()
        wait_until(lambda: _readings(listener), 2.0, "the reading")
        seen = len(listener.batches)
        wait_until(lambda: any(map(_ticks, listener.batches[seen:])), 2.0, "a tick again")
    assert all(len(batch) == 1 for batch in listener.batches if _ticks(batch))


@pytest.mark.parametrize("mode", Mode)
def test_a_reading_of_the_twin_waits_only_where_the_twin_leads_nobody(
    mode: Mode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All else wakes the engine in each mode: the robot, a link, a plan or a stop of the twin."""
    engine, woke = Engine(SETUP, Links(), Links(), Listener().stepped), []
    lead = msgspec.structs.replace(engine.state.lead, mode=mode)
    engine.state = msgspec.structs.replace(engine.state, lead=lead)
    monkeypatch.setattr(engine._inputs, "put", lambda event, wakes: woke.append(wakes))
    at_home = JointMotion.at_rest(HOME)
    engine.put(TwinMeasured(0.0, at_home))
    engine.put(RealMeasured(0.0, 0.0, 0.0, 10, at_home))
    engine.put(LinkChanged(0.0, "twin", False, "cut"))
    engine.put(TwinMotion(0.0, "STOPPED", 0.0, 0.0, 0.0, 0, True, "stopped"))
    assert woke == [mode not in (Mode.IDLE, Mode.REAL_LEADS), True, True, True]


def _ticks(batch: list[AnyEvent]) -> int:
    """Return how many plain ticks are in a batch: none that tells of a standstill."""
    return sum(isinstance(e, Tick) and not (e.own_gap or e.stood) for e in batch)


def _of_links(batch: list[AnyEvent]) -> bool:
    return any(isinstance(event, LinkChanged) for event in batch)


def _readings(listener: Listener) -> list[RealMeasured]:
    return [e for batch in listener.batches for e in batch if isinstance(e, RealMeasured)]


def _gap(event: AnyEvent) -> float:
    return event.own_gap if isinstance(event, Tick) else 0.0
