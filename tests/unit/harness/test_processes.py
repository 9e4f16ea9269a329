"""Processes of the tests end when they are asked to."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.processes import Stage


@pytest.fixture
def in_the_background() -> Iterator[None]:
    """Ignore SIGINT, as a shell lets what it starts with ``&``."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("in_the_background")
def test_a_run_in_the_background_ends_its_processes_by_sigint_too(tmp_path: Path) -> None:
    """Each of them was waited for until SIGTERM, 8 s."""
    stage = Stage(tmp_path, dict(os.environ))
    assert stage.start("sleep", "1000").stop() == -signal.SIGINT
    stage.close()
