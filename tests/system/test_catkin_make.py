"""ROS's own builders take the repository as it is cloned."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from harness.sources import PACKAGES, package_name
from harness.workspace import ROOT

pytestmark = [pytest.mark.system, pytest.mark.thorough]

NAMES = sorted(package_name(folder) for folder in PACKAGES)
MESSAGES = ("scara_msgs", "control_msgs", "industrial_msgs")
LEFT = ("control_msgs", "industrial_msgs")
ENV = {"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "ROS_PYTHON_VERSION": "3"}
SYSTEM_PYTHON = "-DPYTHON_EXECUTABLE=/usr/bin/python3"


def run(command: list[str], folder: Path, home: Path) -> str:
    """Run a command to its end in an empty environment; return what it printed."""
    done = subprocess.run(
        command,
        cwd=folder,
        env=ENV | {"HOME": str(home), "ROS_HOME": str(home)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300.0,
    )
    assert done.returncode == 0, done.stdout[-3000:]
    return done.stdout


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Give a fresh clone of what is committed."""
    folder = tmp_path / "clone"
    run(["git", "clone", "--quiet", str(ROOT), str(folder)], tmp_path, tmp_path)
    return folder


@pytest.mark.parametrize("builder", ["catkin_make", "catkin_make_isolated"])
def test_every_package_is_built_in_a_fresh_clone(builder: str, clone: Path, tmp_path: Path) -> None:
    """Without ./cell and its environment: each package is found there, messages are importable."""
    told = run([builder, "-j2", SYSTEM_PYTHON], clone, tmp_path)
    assert f"traversing {len(NAMES)} packages in topological order" in told, told[:3000]
    if builder == "catkin_make_isolated":
        assert f"Processing catkin package: '{NAMES[-1]}'" in told
        assert told.count("==> Processing catkin package:") == len(NAMES)
    space = "devel" if builder == "catkin_make" else "devel_isolated"
    script = f'. {space}/setup.bash && for name in "$@"; do rospack find "$name"; done'
    found = run(["bash", "-c", script, "bash", *NAMES], clone, tmp_path).split()
    assert len(found) == len(NAMES)
    assert all(place.startswith(str(clone)) for place in found), found
    imports = "; ".join(f"import {name}.msg" for name in MESSAGES)
    script = f". {space}/setup.bash && /usr/bin/python3 -c '{imports}'"
    run(["bash", "-c", script], clone, tmp_path)


def test_messages_that_the_distribution_has_are_left_to_it(clone: Path, tmp_path: Path) -> None:
    """As on a Noetic: ours are built nowhere, and what needs them finds the installed ones."""
    prefix, workspace = tmp_path / "ros", tmp_path / "of_the_distribution"
    for name in LEFT:
        package = workspace / "src" / name
        shutil.copytree(clone / "src" / name, package)
        text = (package / "package.xml").read_text(encoding="utf-8")
        other = text.replace("</version>", "9</version>")
        (package / "package.xml").write_text(other, encoding="utf-8")
    words = ["catkin_make", "-j2", SYSTEM_PYTHON]
    run([*words, f"-DCMAKE_INSTALL_PREFIX={prefix}", "install"], workspace, tmp_path)
    script = f'. {prefix}/setup.bash && "$@"'
    told = run(["bash", "-c", script, "bash", *words], clone, tmp_path)
    assert all(f"{name}: skipped, {prefix} has it" in told for name in LEFT), told[:3000]
    script = '. devel/setup.bash && for name in "$@"; do rospack find "$name"; done'
    found = run(["bash", "-c", script, "bash", *LEFT], clone, tmp_path).split()
    assert found == [f"{prefix}/share/{name}" for name in LEFT]
