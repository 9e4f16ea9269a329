"""The load of a busy machine ends by itself and leaves nothing behind."""

from __future__ import annotations

import multiprocessing
import resource

import pytest
from harness.running.busy import main


def test_load_ends_by_itself() -> None:
    """It has computed meanwhile; no process of it is left."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    assert main(["0.3", "50"]) == 0
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime > before
    assert multiprocessing.active_children() == []


@pytest.mark.parametrize("words", [[], ["soon"], ["-1"], ["1", "0"], ["1", "101"]])
def test_wrong_words_are_refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """What is allowed is said; nothing is started."""
    assert main(words) == 2
    assert capsys.readouterr().out
