"""A mutant is tried in a child process, in place of the module and without a change of any file."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from harness.mutants.trial import Trial, Verdict

SOURCE = "def double(x):\n    return 2 * x\n"
TEST = "from trial_subject import double\n\ndef test_double():\n    assert double(3) == 6\n"


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write a module and its test."""
    path = tmp_path / "trial_subject.py"
    path.write_text(SOURCE)
    (tmp_path / "test_double.py").write_text(TEST)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    return path


@pytest.mark.parametrize(
    ("source", "limit", "expected"),
    [
        (SOURCE, 60.0, Verdict.SURVIVED),
        (SOURCE.replace("2 * x", "x * 2"), 60.0, Verdict.SURVIVED),
        (SOURCE.replace("2 * x", "2 + x"), 60.0, Verdict.KILLED),
        (SOURCE.replace("2 * x", "nothing"), 60.0, Verdict.KILLED),
        ("while True:\n    pass\n", 3.0, Verdict.TIMED_OUT),
    ],
    ids=["the module itself", "equivalent", "another result", "an error", "an endless loop"],
)
def test_a_fault_is_noticed_by_the_test_that_it_breaks(
    module: Path, source: str, limit: float, expected: Verdict
) -> None:
    """The file stays as it is, whatever the child imported."""
    tests = [str(module.parent / "test_double.py")]
    trial = Trial(module.parent, module, source, tests, limit, module.parent / "log.txt")
    assert trial.wait() is expected, trial.log.read_text()
    assert module.read_text() == SOURCE
    assert "trial_subject" not in sys.modules
