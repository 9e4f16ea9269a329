"""The example joins a desk with nothing of this project, and the tutorial names every example."""

from __future__ import annotations

import subprocess
import sys
import time

from farm.desk.commands_io import order
from farm.keys import CellName
from farm.wire import Answer
from harness.processes import wait_until
from harness.workspace import ROOT
from unit.farm.conftest import Farm

FEEDER = CellName("site", "my_machine", "feeder")
FILE = ROOT / "examples" / "join_the_farm.py"


def test_the_feeder_joins_is_shown_and_stops(farm: Farm) -> None:
    """Its state, its events by number, and its answer to a STOP."""
    session = farm.router()
    desk = farm.desk(session)
    words = [sys.executable, str(FILE), str(farm.config.router.port)]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    try:
        wait_until(lambda: [r.status for r in desk.rows()] == ["feeds"], 20.0, "the feeder")
        slow = time.time() - 60.0  # the desk's clock, so the STOP has expired when it comes
        (answered,) = order(session, [FEEDER], "STOP", "ann", "desk", 2.0, lambda: slow)
        assert answered.answer == Answer(True, "received")
        (refused,) = order(session, [FEEDER], "HOME", "ann", "desk", 2.0)
        assert refused.answer is not None and not refused.answer.accepted
        wait_until(lambda: [r.status for r in desk.rows()] == ["stands"], 10.0, "the stop")
        wait_until(lambda: desk.progress()[FEEDER].last == 2, 10.0, "both events")
    finally:
        process.kill()
        process.wait()
    assert desk.unreadable == 0


def test_the_tutorial_names_every_example() -> None:
    """Whoever looks for a first step finds it there."""
    told = (ROOT / "docs" / "learn" / "tutorial.md").read_text(encoding="utf-8")
    names = {path.name for path in (ROOT / "examples").iterdir() if path.suffix}
    assert {name for name in names if f"examples/{name}" not in told} == set()
