"""Which file is in force.

That of the chosen robot's folder before the shared one, in a flat folder the only one.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from scara_config import ConfigError, files_in_force, locate
from scara_config.profile import known_robots


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a folder with two robots, the second of which brings its own motion.yaml."""
    monkeypatch.delenv("SCARA_ROBOT", raising=False)
    files = ("motion.yaml", "robots/fanuc_sr6ia/robot.yaml", "robots/fanuc_sr6ia/programs/A.LS")
    for name in (
        *files,
        "robots/other/robot.yaml",
        "robots/other/motion.yaml",
        "robots/other/programs/B.LS",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"where: {name}\n")
    return tmp_path


def test_without_a_choice_it_is_the_articles_robot(shared: Path) -> None:
    """`./cell demo` needs no option."""
    assert locate("robot.yaml", shared) == shared / "robots" / "fanuc_sr6ia" / "robot.yaml"
    assert locate("motion.yaml", shared) == shared / "motion.yaml"


def test_a_robot_brings_what_is_its_own_and_shares_the_rest(
    shared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whole files: no key is merged from two places."""
    monkeypatch.setenv("SCARA_ROBOT", "other")
    found = {
        name: path.relative_to(shared).as_posix() for name, path in files_in_force(shared).items()
    }
    assert found == {
        "motion.yaml": "robots/other/motion.yaml",
        "robot.yaml": "robots/other/robot.yaml",
        "programs/B.LS": "robots/other/programs/B.LS",
    }


def test_an_unknown_robot_is_refused_with_the_known_ones(
    shared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A typing error starts nothing."""
    monkeypatch.setenv("SCARA_ROBOT", "othr")
    with pytest.raises(ConfigError, match=r"unknown robot 'othr': .*robots has fanuc_sr6ia, other"):
        locate("robot.yaml", shared)


def test_a_file_that_is_nowhere_is_missed_in_the_robots_own_folder(
    shared: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody who writes a new robot is told where its file has to be."""
    monkeypatch.setenv("SCARA_ROBOT", "other")
    assert locate("pid_gains.yaml", shared) == shared / "robots" / "other" / "pid_gains.yaml"


def test_a_flat_folder_holds_one_robot_whatever_is_chosen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a run was made with stays whole; a file that is missing there is named there."""
    monkeypatch.setenv("SCARA_ROBOT", "other")
    assert known_robots(tmp_path) == []
    assert locate("robot.yaml", tmp_path) == tmp_path / "robot.yaml"
