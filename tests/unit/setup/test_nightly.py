"""`./cell test --nightly`: three parts one after the other, whatever fails, and one exit code."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
import typer
from harness.running import nightly as nights
from harness.workspace import ROOT

STAND_INS = """
set -u; root=$PWD
night() {
  echo "night $*" >&2
  [ "$1" != begin ] || echo "1 --seed 7 core motion"
  [ "$1" != "$FAILS" ]
}
run_tests() { echo "tests $HYPOTHESIS_SEARCH turn $CELL_TEST_TURN $*" >&2; exit $TESTS; }
run_clients() { echo "clients ${HYPOTHESIS_SEARCH:-} $*" >&2; exit $CLIENTS; }
run_mutants() { echo "mutants $*" >&2; return $MUTANTS; }
"""


def nightly(folder: Path, *words: str, **codes: str) -> tuple[int, list[str]]:
    """Return the exit code and what was called."""
    source = (ROOT / "setup" / "nightly.sh").read_text()
    done = subprocess.run(
        ["bash", "-c", f'{source}\n{STAND_INS}\nrun_nightly "$@"', "bash", *words],
        cwd=folder,
        env={"TESTS": "0", "CLIENTS": "0", "MUTANTS": "0", "FAILS": "", "PATH": "/bin"} | codes,
        capture_output=True,
        text=True,
        timeout=30,
    )
    return done.returncode, done.stderr.splitlines()


def test_each_part_is_run_and_its_exit_code_reaches_the_report(tmp_path: Path) -> None:
    """Whatever fails before it; other people's programs are run once, with their reports."""
    code, called = nightly(tmp_path, "-k", "a b", TESTS="1", CLIENTS="2", MUTANTS="3")
    assert called == [
        "night begin",
        "tests 1 turn 1 --ignore=tests/clients --continue-on-collection-errors -k a b",
        "clients  --junitxml=build/night/test_clients.xml -k a b",
        "mutants --mutants 100 --seed 7 core motion",
        f"night write --tests 1 --clients 2 --mutants 3 --page {tmp_path}/build/nightly.md "
        "--words=-k a b",
    ]
    assert code == 0


def test_a_short_night_has_few_mutants_and_a_page_elsewhere(tmp_path: Path) -> None:
    """To try the chain."""
    _, called = nightly(tmp_path, "--mutants", "5", "--page", "/tmp/x.md")
    assert "mutants --mutants 5 --seed 7 core motion" in called
    assert called[-1].endswith("--mutants 0 --page /tmp/x.md --words=--mutants 5")


def test_a_whole_night_writes_the_page(tmp_path: Path) -> None:
    """And no word of a choice."""
    _, called = nightly(tmp_path)
    assert called[-1].endswith(f"--page {tmp_path}/docs/nightly.md --words=")


@pytest.mark.parametrize(("fails", "calls"), [("begin", 1), ("write", 5)])
def test_the_exit_code_is_that_of_the_report(tmp_path: Path, fails: str, calls: int) -> None:
    """It tells of all parts; a night that cannot begin runs nothing."""
    code, called = nightly(tmp_path, FAILS=fails)
    assert code == 1 and len(called) == calls


def test_a_run_by_day_does_not_change_what_the_night_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both write the same files; and what only a part was, is told."""
    build, report = tmp_path / "build", tmp_path / "nightly.md"
    for name, file in (("BUILD", ""), ("NIGHT", "nightly.json"), ("REPORTS", "night")):
        monkeypatch.setattr(nights, name, build / file)
    monkeypatch.setattr(nights.summary, "FILE", build / "mutants.json")
    (build / "night").mkdir(parents=True)
    (build / "night" / "test_nodes.xml").write_text("of the night before")
    nights.begin()
    cases = "<testsuites><testsuite time='1.0'>{}</testsuite></testsuites>"
    wrong = "<testcase name='a'><failure message='it is red'/></testcase>"
    source = (ROOT / "setup" / "nightly.sh").read_text()
    (copies,) = [line for line in source.splitlines() if line.startswith("  cp ")]
    away = "".join(
        f"<testcase classname='tests.test_b' name='test_c[{number}.5]'>"
        "<skipped message='no PyKDL'/></testcase>"
        for number in range(3)
    )
    (build / "test_pure.xml").write_text(cases.format(wrong + away))
    subprocess.run(["bash", "-c", copies], cwd=tmp_path, check=True)
    (build / "test_pure.xml").write_text(cases.format("<testcase name='a'/>"))
    with pytest.raises(typer.Exit):
        nights.write(1, 0, 0, report, "-k stop")
    told = report.read_text()
    assert "| `tests.test_b` | 3 | no PyKDL |" in told and "| pure | 0:00:01 | 0 | 1 | 3 |" in told
    assert "| `a` | it is red |" in told and "| nodes | did not end |" in told
    assert "Only what these words choose: `-k stop`.\n**Failed: tests (exit code 1).**" in told
