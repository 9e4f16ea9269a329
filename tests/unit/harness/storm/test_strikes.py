"""A node that a storm starts again outlives the thread of its fault."""

from __future__ import annotations

import threading
from pathlib import Path

from harness.processes import Process
from harness.storm.strikes import STARTER


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
