"""Faults of a storm: seen where they break what they shall."""

from __future__ import annotations

import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.processes import Process
from harness.storm.strikes import Strikes


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
