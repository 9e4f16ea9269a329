"""A test that hangs is ended, says where it hung, and leaves no process behind."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from harness.processes import wait_until
from harness.running.thorough import thorough
from harness.workspace import ROOT

LIMIT_S = 3
HANGS = """
import time
import pytest
from harness.processes import Stage

@pytest.fixture
def stage(tmp_path):
    stage = Stage(tmp_path, {})
    yield stage
    stage.close()

def test_that_waits_for_ever(stage):
    stage.start("/bin/sleep", "MARK")
    time.sleep(10_000)
"""


@pytest.mark.parametrize("words", [*thorough([]), ["-n", "1"]], ids=["alone", "in a worker"])
def test_a_test_that_hangs_ends_in_its_limit_with_stacks_and_without_a_child(
    tmp_path: Path, words: list[str]
) -> None:
    """As the project's own settings have it, but for the length of the limit."""
    mark = f"4242{len(words)}.25"
    test = tmp_path / "test_hangs.py"
    test.write_text(HANGS.replace("MARK", mark))
    settings = ("-c", str(ROOT / "pyproject.toml"), "-o", f"timeout={LIMIT_S}")
    run = subprocess.run(
        [sys.executable, "-m", "pytest", *settings, "-p", "no:cacheprovider", *words, str(test)],
        capture_output=True,
        text=True,
        timeout=60.0,
        cwd=ROOT,
        check=False,
    )
    said = run.stdout + run.stderr
    assert run.returncode == 1, said
    assert "1 failed" in said and f"Timeout (>{LIMIT_S}" in said and "time.sleep(10_000)" in said
    wait_until(lambda: not sleeps(mark), 5.0, f"the end of sleep {mark}")


def test_the_stacks_are_printed_before_the_test_is_ended() -> None:
    """A run that is ended from outside meanwhile has told where it hung."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    limits = dict(re.findall(r"^(faulthandler_timeout|timeout) = (\d+)$", text, re.MULTILINE))
    assert 0 < int(limits["faulthandler_timeout"]) < int(limits["timeout"])


def sleeps(mark: str) -> bool:
    """Return whether the child of the test still runs."""
    return any(mark in (one.info["cmdline"] or []) for one in psutil.process_iter(["cmdline"]))
