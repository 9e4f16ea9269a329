"""A process that SIGINT does not end is named at the end of a run."""

from __future__ import annotations

import signal
from types import SimpleNamespace
from typing import Any

import pytest
from harness import processes
from harness.processes import DEAF, Process

INT, TERM, KILL = signal.SIGINT, signal.SIGTERM, signal.SIGKILL


def node(ends_by: signal.Signals, monkeypatch: pytest.MonkeyPatch) -> Process:
    """Return a process that only this signal ends."""
    told: list[signal.Signals] = []
    monkeypatch.setattr(processes.os, "killpg", lambda group, number: told.append(number))

    def wait(timeout: float) -> int:
        if ends_by not in told:
            raise processes.subprocess.TimeoutExpired("node", timeout)
        return -ends_by

    made = object.__new__(Process)
    made.command, made.stalled = ["node"], False
    popen: Any = SimpleNamespace(
        pid=1 << 30, wait=wait, poll=lambda: -ends_by if ends_by in told else None
    )
    made.popen = popen
    return made


@pytest.mark.parametrize(
    ("ends_by", "before", "noted"),
    [
        (INT, [], 0),
        (TERM, [], 1),
        (KILL, [], 1),
        (KILL, [signal.SIGSTOP], 0),
        (KILL, [signal.SIGSTOP, signal.SIGCONT], 1),
        (KILL, [KILL], 0),
    ],
    ids=["in time", "asked twice", "killed", "stalled", "let go on", "killed by its test"],
)
def test_a_process_that_sigint_does_not_end_is_noted(
    ends_by: signal.Signals,
    before: list[signal.Signals],
    noted: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Unless its own test has stalled or killed it."""
    made = node(ends_by, monkeypatch)
    for number in before:
        made.signal(number)
    assert made.stop(grace=8.0) == -ends_by
    assert DEAF.take() == noted * ["node: SIGINT has not ended it within 8 s"]
