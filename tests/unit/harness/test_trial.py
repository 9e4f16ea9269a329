"""A mutant is tried in a child process, in place of the module and without a change of any file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from harness.workspace import ROOT

SOURCE = "def double(x):\n    return 2 * x\n"
TEST = "from trial_subject import double\n\ndef test_double():\n    assert double(3) == 6\n"
TRY = """
import json, sys
from pathlib import Path
from harness.mutants.trial import Trial
folder, source, limit = json.loads(sys.argv[1])
module = Path(folder) / "trial_subject.py"
tests, log = [str(module.parent / "test_double.py")], module.parent / "log.txt"
verdict = Trial(module.parent, module, source, tests, limit, log).wait()
assert "trial_subject" not in sys.modules
print(verdict.name)
"""
"""Trials are forked: from a process without threads, as that of the mutants is."""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("source", "limit", "expected"),
    [
        (SOURCE, 60.0, "SURVIVED"),
        (SOURCE.replace("2 * x", "x * 2"), 60.0, "SURVIVED"),
        (SOURCE.replace("2 * x", "2 + x"), 60.0, "KILLED"),
        (SOURCE.replace("2 * x", "nothing"), 60.0, "KILLED"),
        ("while True:\n    pass\n", 3.0, "TIMED_OUT"),
    ],
    ids=["the module itself", "equivalent", "another result", "an error", "an endless loop"],
)
def test_a_fault_is_noticed_by_the_test_that_it_breaks(
    tmp_path: Path, source: str, limit: float, expected: str
) -> None:
    """The file stays as it is, whatever the child imported. Mutants are made by night alone."""
    module = tmp_path / "trial_subject.py"
    module.write_text(SOURCE)
    (tmp_path / "test_double.py").write_text(TEST)
    path = os.pathsep.join([str(tmp_path), str(ROOT / "tests"), os.environ["PYTHONPATH"]])
    words = json.dumps([str(tmp_path), source, limit])
    found = subprocess.run(
        [sys.executable, "-c", TRY, words],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=120.0,
        check=False,
    )
    log = tmp_path / "log.txt"
    said = log.read_text() if log.exists() else ""
    assert (found.returncode, found.stdout.strip()) == (0, expected), found.stderr + said
    assert module.read_text() == SOURCE
