"""What a change can reach is run, and what it cannot reach is not."""

from __future__ import annotations

import pytest
from harness.running.changed import (
    BESIDE,
    LIVE_CORE,
    GitError,
    changed_files,
    main,
    reached,
    reached_by,
    room_of,
)
from harness.running.lanes import SLOW, part_of
from harness.running.rooms import ROOMS
from harness.workspace import ROOT


@pytest.mark.parametrize(
    ("file", "room"),
    [
        ("config/motion.yaml", "scara_config"),
        ("src/what_if/src/what_if/judging.py", "what_if"),
        ("tests/unit/farm/test_bus.py", "farm"),
        ("tests/ros/test_emulator.py", ""),
        ("cell", ""),
    ],
)
def test_each_file_is_of_a_room_or_of_none(file: str, room: str) -> None:
    """By its path alone: a file that was removed has a room too."""
    assert room_of(file) == room


def test_arrows_are_followed_to_all_that_stand_on_a_room() -> None:
    """And not down to what a room uses."""
    assert reached(["twin_experiments"]) == {"twin_experiments", "twin_analysis", "scara_course"}
    simulated = {"scara_simulation", "what_if", "twin_analysis", "robot_doctor", "scara_course"}
    assert reached(["scara_simulation"]) == simulated
    assert {"twin_controller", "robot_doctor", "what_if"} <= reached(["scara_control"])
    assert "farm" not in reached(["scara_control"])
    assert reached(["scara_config"]) >= set(ROOMS) - {
        "scara_msgs",
        "control_msgs",
        "industrial_msgs",
    }


def test_change_of_a_room_runs_its_nodes_and_what_stands_on_it() -> None:
    """No browser, and nothing of a room that it cannot reach."""
    found = reached_by(["src/scara_control/src/scara_control/kinematics/scara.py"])
    assert "tests/ros/test_motion_nodes.py" in found
    assert "tests/unit/twin_controller/core/test_late.py" in found
    assert "tests/virtual_time/test_figures.py" in found
    assert "tests/unit/scara_control/motion" in {test.rpartition("/")[0] for test in found}
    assert not [test for test in found if test.startswith("tests/unit/twin_controller/services/")]
    assert not [test for test in found if "/farm/" in test or part_of(test) == "pages"]
    alone = reached_by(["src/what_if/src/what_if/judging.py"])
    assert {test.split("/")[2] for test in alone} == {"what_if"}


def test_change_that_has_no_room_runs_everything_it_may_be_in() -> None:
    """What runs the tests, the build, their settings; words run the contract tests alone."""
    whole = set(reached_by(["tests/harness/running/repeats.py"]))
    assert whole == set(reached_by(["pyproject.toml"])) == set(reached_by(["tests/conftest.py"]))
    assert whole >= {f"tests/ros/{name}" for name in BESIDE if name.endswith(".py")}
    assert reached_by(["docs/interfaces.md", "README.md", "examples/a.py"]) == []
    for read in ("contract/budget.yaml", "golden/emulator_snapshots.yaml"):
        assert reached_by([f"tests/{read}"]) == [], "by tests that always run"
    assert reached_by(["bench/page.py"]) == ["tests/unit/bench/test_journal.py"]
    assert "tests/unit/setup/test_cell.py" in reached_by(["setup/checks.sh"])
    own = "tests/ros/operator_panel/test_stop.py"
    assert reached_by([own]) == [own], "who changes a browser's test runs it"
    assert reached_by(["tests/unit/farm/test_gone.py"]) == []


def test_change_of_the_harness_runs_what_uses_it() -> None:
    """By any number of steps, by a module's name or a file's; and no slow test beside it."""
    wires = reached_by(["tests/harness/wires/state_answer.py"])
    assert "tests/ros/test_wrong_values.py" in wires
    assert not [test for test in wires if test.startswith("tests/virtual_time/")]
    schedule = reached_by(["tests/harness/virtual_cell/schedule.py"])
    assert "tests/virtual_time/stops/test_stop_table.py" in schedule
    assert "tests/virtual_time/test_figures.py" in reached_by(["tests/virtual_time/baseline.json"])
    used = reached_by(["tests/ros/twin_controller/conftest.py"])
    assert used and {test.rpartition("/")[0] for test in used} == {"tests/ros/twin_controller"}


def test_every_path_leads_to_tests() -> None:
    """A folder that was renamed would be left out in silence."""
    paths = [*LIVE_CORE, *(f"tests/unit/{part}" for part in SLOW)]
    assert [path for path in paths if not (ROOT / path).exists()] == []
    place = ROOT / "tests" / "ros"
    loose = {path.name for path in place.iterdir() if list(path.rglob("test_*.py"))} - set(ROOMS)
    loose |= {file.name for file in place.glob("test_*.py")}
    assert loose == {*BESIDE, "test_harness.py"} and set(BESIDE.values()) <= set(ROOMS)


def test_unknown_commit_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is run then."""
    with pytest.raises(GitError):
        changed_files("no_such_commit")
    assert main(["no_such_commit"]) == 2
    assert "cell: what has changed?" in capsys.readouterr().err
