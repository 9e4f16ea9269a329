"""A live test that fails is played again only where the machine stood still."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.processes import DEAF
from harness.running.plugin import Running
from harness.running.thorough import SEARCH
from harness.workspace import ROOT
from hypothesis.internal.conjecture import providers

CONFTEST = """
from harness.running import repeats
from harness.running.plugin import Running

repeats.MACHINE.stood_still = lambda since: {gap}


def pytest_configure(config):
    config.pluginmanager.register(Running())
"""
TESTS = """
import pytest

seen = []


@pytest.fixture(scope="session")
def master():
    seen.append("master")


@pytest.fixture(scope="module")
def wide(master):
    seen.append("wide")
    yield
    seen.append("wide ends")


@pytest.fixture
def own(wide, tmp_path):
    seen.append("own")
    yield tmp_path
    seen.append("own ends")
    assert {clean} or seen.count("own") > 1, "left behind"


def test_first(own):
    (own / "log").mkdir()
    assert seen.count("own") > 1, "the first fails"


def test_second():
    again = ["own ends", "wide ends", "wide", "own"]
    assert seen == ["master", "wide", "own", *again, "own ends"]


def test_third():
    if {fails}:
        pytest.fail("for good")
"""


def said(folder: Path, place: str, gap: float, clean: bool = True, fails: bool = False) -> str:
    """Return what pytest prints of those tests, played from a folder."""
    tests = folder / place
    tests.mkdir(parents=True)
    (folder / "conftest.py").write_text(CONFTEST.format(gap=gap), encoding="utf-8")
    (tests / "test_some.py").write_text(TESTS.format(clean=clean, fails=fails), encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    words = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-rA", place]
    env = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT / "tests")}
    done = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, timeout=60.0)
    return done.stdout


def test_an_attempt_has_fixtures_of_its_own_and_its_reason_is_told(tmp_path: Path) -> None:
    """What an attempt wrote and started is none of the next one's."""
    told = said(tmp_path, "tests/ros", gap=0.045)
    assert "3 passed" in told and "failed" not in told, told
    assert "1 repeats in 3 scenes" in told
    assert "test_first: the machine stood still for 45 ms; the first fails" in told


@pytest.mark.parametrize(
    ("place", "gap"),
    [("tests/system", 0.0), ("tests/unit", 0.045)],
    ids=["in time: it is the product's fault", "pure"],
)
def test_what_has_no_excuse_is_played_once(tmp_path: Path, place: str, gap: float) -> None:
    """The next test goes on with what there is."""
    told = said(tmp_path, place, gap, fails=True)
    assert "for good" in told and "3 failed" in told, told
    assert "FAILED tests" in told and "test_first - AssertionError: the first fails" in told, told
    assert "stood still" not in told


def test_what_an_excused_attempt_leaves_behind_has_no_excuse(tmp_path: Path) -> None:
    """The next attempt passes, and the run fails all the same."""
    told = said(tmp_path, "tests/ros", gap=0.045, clean=False)
    assert "3 passed, 1 error" in told, told
    assert "ERROR tests/ros/test_some.py::test_first - AssertionError: left behind" in told


def test_numbers_in_the_code_choose_examples_in_a_search_alone() -> None:
    """By day the same are drawn whatever has changed."""
    importlib.import_module("scara_control.kinematics.numeric")
    assert (len(providers._get_local_constants()) > 0) is SEARCH


def test_what_sigint_has_not_ended_is_told_at_the_end_of_a_run() -> None:
    """By the test that had started it; nobody fails by it."""
    running, lines = Running(), list[str]()
    item: Any = SimpleNamespace(user_properties=[])
    ended: Any = SimpleNamespace(when="teardown", excinfo=None)
    DEAF.add("node: SIGINT has not ended it")
    running.pytest_runtest_makereport(item, ended)
    report: Any = SimpleNamespace(when="teardown", nodeid="test_a", **vars(item))
    running.pytest_runtest_logreport(report)
    terminal: Any = SimpleNamespace(section=lines.append, line=lines.append)
    running.pytest_terminal_summary(terminal)
    assert lines[-1] == "  test_a: node: SIGINT has not ended it" and len(lines) == 2
