"""CMake and ROS's own builders take the repository as it is cloned."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from harness.ros import Ros
from harness.running.rooms import ROOMS
from harness.sources import PACKAGES, package_name
from harness.workspace import ROOT
from std_msgs.msg import String

pytestmark = pytest.mark.system

NAMES = sorted(package_name(folder) for folder in PACKAGES)
MESSAGES = ("scara_msgs", "control_msgs", "industrial_msgs")
NEEDED = sorted({"scara_description", "industrial_msgs"} | ROOMS["scara_description"])
"""What a node of scara_description needs, and some messages."""
LEFT = ("control_msgs", "industrial_msgs")
ENV = {"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "ROS_PYTHON_VERSION": "3"}
QUICK = {"ROS_LANG_DISABLE": "gencpp:genlisp"}
"""Messages for Python only: nothing here is in another language."""
SYSTEM_PYTHON = "-DPYTHON_EXECUTABLE=/usr/bin/python3"


def run(command: list[str], folder: Path, home: Path, env: dict[str, str] = QUICK) -> str:
    """Run a command to its end in an empty environment; return what it printed.

    It judges no times: it leaves the processor to the cells that are tested beside it.
    """
    done = subprocess.run(
        ["nice", "-n", "10", *command],
        cwd=folder,
        env=ENV | {"HOME": str(home), "ROS_HOME": str(home)} | env,
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


def other_python_first(folder: Path) -> dict[str, str]:
    """Return a PATH that begins with another Python, which nothing here may ask."""
    first = folder / "other"
    first.mkdir()
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    for name in ("python3", "python3-config", f"python{version}-config"):
        fake = first / name
        fake.write_text("#!/bin/sh\necho another python3 was asked >&2; exit 1\n")
        fake.chmod(0o755)
    return {"PATH": f"{first}:{ENV['PATH']}"}


def interpreters(devel: Path, names: Sequence[str] = NAMES) -> set[str]:
    """Return the first lines of the nodes of a devel space."""
    folders = [folder for folder in PACKAGES if package_name(folder) in names]
    nodes = [node for folder in folders for node in (folder / "nodes").glob("*")]
    built = [devel / "lib" / node.parent.parent.name / node.name for node in nodes]
    return {node.read_text(encoding="utf-8").partition("\n")[0] for node in built}


def give_libraries(clone: Path) -> None:
    """Give the clone the .venv that is here."""
    run(["ln", "-sfn", str(ROOT / ".venv"), ".venv"], clone, clone.parent)


def assert_whole(space: Path, clone: Path, home: Path, built: Sequence[str] = NAMES) -> None:
    """Check that each package is found in the clone, and that built messages are importable."""
    script = 'source "$1/setup.bash" && shift && for name in "$@"; do rospack find "$name"; done'
    found = run(["bash", "-c", script, "bash", str(space), *NAMES], clone, home).split()
    folders = [clone / folder.relative_to(ROOT) for folder in PACKAGES]
    assert sorted(found) == sorted(map(str, folders))
    imports = "; ".join(f"import {name}.msg" for name in MESSAGES if name in built)
    script = 'source "$1/setup.bash" && /usr/bin/python3 -c "$2"'
    run(["bash", "-c", script, "bash", str(space), imports], clone, home)


def assert_node_starts(space: Path, ros: Ros) -> None:
    """Start a node by rosrun, which answers from that space."""
    script = 'source "$1/setup.bash" && exec rosrun scara_description robot_state_publisher'
    node = ros.stage.start(
        "env", "-i", *map("=".join, given(ros)), "bash", "-c", script, "-", space
    )
    ros.wait_for_message("robot_description", String)
    opened = Path(f"/proc/{node.pid}/cmdline").read_text(encoding="utf-8")
    assert str(space) in opened, opened
    node.stop()


def given(ros: Ros) -> list[tuple[str, str]]:
    """Return what a shell of a person has who has a master and nothing else."""
    names = ("ROS_MASTER_URI", "ROS_NAMESPACE", "ROS_HOME", "ROS_IP", "HOME")
    return [*ENV.items(), *((name, ros.env[name]) for name in names)]


@pytest.mark.thorough
def test_cmake_builds_a_fresh_clone_with_the_interpreter_of_its_venv(
    clone: Path, ros: Ros, tmp_path: Path
) -> None:
    """Two lines and no ./cell: all packages are built, and a node starts by rosrun.

    Each time the set-up builds this folder by the same two lines.
    """
    give_libraries(clone)
    told = run(["cmake", "-S", ".", "-B", "build"], clone, tmp_path)
    assert f"traversing {len(NAMES)} packages in topological order" in told, told[:3000]
    assert "lacks" not in told and "Warning" not in told, told
    run(["cmake", "--build", "build", "--", "-j2"], clone, tmp_path)
    assert interpreters(clone / "devel") == {f"#!{clone}/.venv/bin/python"}
    assert_whole(clone / "devel", clone, tmp_path)
    assert_node_starts(clone / "devel", ros)


@pytest.mark.thorough
@pytest.mark.parametrize("names", [NEEDED, NAMES], ids=len)
def test_catkin_make_builds_a_fresh_clone_and_tells_what_is_missing(
    clone: Path, ros: Ros, tmp_path: Path, names: list[str]
) -> None:
    """Without .venv, and another python3 first on PATH; with .venv the next build is whole.

    Each time the set-up configures and builds all packages, by the same CMakeLists.txt.
    """
    env = QUICK | other_python_first(tmp_path)
    wanted = f"-DCATKIN_WHITELIST_PACKAGES={';'.join(names)}"
    words = ["catkin_make", "--source", ".", "-j2", wanted]
    told = run(words, clone, tmp_path, env)
    assert f"traversing {len(names)} packages in topological order" in told, told[:3000]
    lines = [line for line in told.splitlines() if line.startswith("Nodes will not start")]
    assert len(lines) == 1 and "/usr/bin/python3 lacks" in lines[0] and "msgspec" in lines[0]
    assert interpreters(clone / "devel", names) == {"#!/usr/bin/python3"}
    assert_whole(clone / "devel", clone, tmp_path, names)

    give_libraries(clone)
    told = run([*words, "--force-cmake"], clone, tmp_path, env)
    assert "Nodes will not start" not in told
    assert interpreters(clone / "devel", names) == {f"#!{clone}/.venv/bin/python"}
    assert_node_starts(clone / "devel", ros)


@pytest.mark.thorough
def test_catkin_make_isolated_builds_a_fresh_clone(clone: Path, tmp_path: Path) -> None:
    """Each package by itself."""
    words = ["catkin_make_isolated", "--source", ".", "-j2", SYSTEM_PYTHON]
    told = run(words, clone, tmp_path)
    assert f"traversing {len(NAMES)} packages in topological order" in told, told[:3000]
    assert told.count("==> Processing catkin package:") == len(NAMES)
    assert_whole(clone / "devel_isolated", clone, tmp_path)


@pytest.mark.thorough
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
    build = ["catkin_make", "--source", ".", "-j2"]
    told = run(["bash", "-c", script, "bash", *build], clone, tmp_path)
    assert all(f"{name}: skipped, {prefix} has it" in told for name in LEFT), told[:3000]
    script = '. devel/setup.bash && for name in "$@"; do rospack find "$name"; done'
    found = run(["bash", "-c", script, "bash", *LEFT], clone, tmp_path).split()
    assert found == [f"{prefix}/share/{name}" for name in LEFT]
