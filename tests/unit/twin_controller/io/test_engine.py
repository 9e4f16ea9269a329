"""The engine's thread: who watches it, and what it does with an error."""

from __future__ import annotations

import threading
from typing import Any

import pytest
from harness.pair import SETUP
from harness.processes import wait_until
from twin_controller.core.actions import Decided
from twin_controller.core.events import AnyEvent, LinkChanged
from twin_controller.core.state import CoreState
from twin_controller.io.engine import ALIVE, Engine


class Doors:
    """Both doors: nothing goes out."""

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None


class Listener:
    """Hangs or fails on demand when it hears of a link."""

    def __init__(self) -> None:
        self.go_on = threading.Event()
        self.go_on.set()
        self.fails = False

    def stepped(self, events: list[AnyEvent], state: CoreState, decided: list[Decided]) -> None:
        """Hear of a batch."""
        if any(isinstance(event, LinkChanged) for event in events):
            if self.fails:
                raise RuntimeError("a bug")
            self.go_on.wait(5.0)


def test_engine_that_hangs_is_not_alive() -> None:
    """Whoever beats for it must know; when it goes on it is alive again."""
    listener = Listener()
    engine = Engine(SETUP, Doors(), Doors(), listener)
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
    with Engine(SETUP, Doors(), Doors(), listener) as engine:
        engine.link_changed("real", False, "cut")
        wait_until(lambda: not engine.running, 2.0, "the end of the engine")
        assert isinstance(engine.failure, RuntimeError) and not engine.alive
