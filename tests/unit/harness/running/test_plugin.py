"""A live test that fails is played again only where the machine stood still."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from harness.processes import DEAF
from harness.running.plugin import Running
from harness.running.thorough import TURN, TURNS
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

PLAYED = """
import pytest
from harness.running.thorough import examples, thorough

COUNT = examples(5, 200)


@pytest.mark.parametrize("number", ["day", *thorough(*range(6))])
def test_some(number, request):
    print(request.path.name, number, COUNT)
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
    assert (len(providers._get_local_constants()) > 0) is ("HYPOTHESIS_SEARCH" in os.environ)


def test_each_night_plays_its_turn_and_all_nights_everything(tmp_path: Path) -> None:
    """Longer scenes by their own names, searches by their file's; the day's tests each time."""
    running = "from harness.running.plugin import Running"
    register = "def pytest_configure(config): config.pluginmanager.register(Running())"
    (tmp_path / "conftest.py").write_text(f"{running}\n{register}\n", encoding="utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = thorough\n", encoding="utf-8")
    files = [f"test_{letter}.py" for letter in "abcdefgh"]
    for file in files:
        (tmp_path / file).write_text(PLAYED, encoding="utf-8")
    nights = []
    for turn in range(TURNS):
        env = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT / "tests")}
        env |= {TURN: str(turn), "HYPOTHESIS_SEARCH": "1"}
        words = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-sq", "."]
        done = subprocess.run(
            words, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=60.0
        )
        assert done.returncode == 0, done.stdout
        nights.append(re.findall(r"(test_\w\.py) (\w+) (\w+)", done.stdout))
    by_day = {(file, "day") for file in files}
    longer = {(file, str(number)) for file in files for number in range(6)}
    played = [{row[:2] for row in night} for night in nights]
    assert played[0] | played[1] == by_day | longer and played[0] & played[1] == by_day
    searched = [{row[0] for row in night if row[2] == "200"} for night in nights]
    assert searched[0] | searched[1] == set(files) and not searched[0] & searched[1]
    assert all(searched) and all(len(each) > len(by_day) + 10 for each in played)


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
