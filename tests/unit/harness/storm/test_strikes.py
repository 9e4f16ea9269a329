"""Faults of a storm: seen where they break what they shall; a node started anew lives on."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.processes import Process
from harness.storm.strikes import STARTER, Strikes


def test_process_lives_on_when_the_thread_that_asked_for_it_ends(tmp_path: Path) -> None:
    """The kernel ends a process with the thread that has started it, which must stay."""
    started: list[Process] = []

    def start() -> None:
        started.append(Process(["sleep", "30"], {}, tmp_path / "log"))

    fault = threading.Thread(target=lambda: STARTER.do(start))
    fault.start()
    fault.join()
    (process,) = started
    with process:
        try:
            process.wait(0.3)
        except AssertionError:
            return
        raise AssertionError(f"it has ended with {process.poll()}")


@pytest.mark.parametrize(("number", "seen"), [(signal.SIGSTOP, True), (signal.SIGCONT, False)])
def test_standstill_is_seen_in_the_process_itself(
    tmp_path: Path, number: signal.Signals, seen: bool
) -> None:
    """A storm whose signal stops nothing has shown nothing."""
    with Process(["sleep", "30"], {}, tmp_path / "log") as process:
        cell: Any = SimpleNamespace(
            processes={"gateway": process},
            stop=lambda node: process.signal(number),
            go_on=lambda node: process.signal(signal.SIGCONT),
        )
        strikes = Strikes(cell)
        strikes.strike("halt", "gateway", 0.05)
        strikes.strike("stall", 0.05)
    assert [strike.seen for strike in strikes.done] == [seen, seen]
