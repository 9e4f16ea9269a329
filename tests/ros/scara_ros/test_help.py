"""``rosrun PACKAGE EXECUTABLE --help``, for each that rosrun finds in our packages."""

from __future__ import annotations

import importlib.util
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.processes import ROSRUN, free_port
from harness.sources import PACKAGES, package_name, started_by
from harness.workspace import ROOT, workspace_environment
from scara_ros.starting.running_node import help_of

BUILT = ROOT / "devel" / "lib"
USAGE = "usage: rosrun {} {} [_PARAMETER:=VALUE ...]"
TABLES = ("Parameters:", "Publishes:", "Subscribes to:", "Offers the services:")


def executables() -> Iterator[tuple[str, str]]:
    """Yield package and name of all of them, the scripts of rostest too."""
    for package in sorted(package_name(folder) for folder in PACKAGES):
        folder = BUILT / package
        for file in sorted(folder.iterdir()) if folder.is_dir() else ():
            if os.access(file, os.X_OK):
                yield package, file.name


def nodes() -> Iterator[tuple[str, str, str]]:
    """Yield package, name and module of those that tell what their source declares."""
    for package, name in executables():
        script = ROOT / "src" / package / "nodes" / name
        if script.is_file() and "run(main)" in script.read_text(encoding="utf-8"):
            yield package, name, started_by(script)


def test_help_of_each_node_has_its_parameters_and_topics() -> None:
    """The tables are those of the source."""
    found = {(package, name): help_of(module) for package, name, module in nodes()}
    assert len(found) > 15
    for node, text in found.items():
        assert USAGE.format(*node) in text and any(table in text for table in TABLES), node


def test_each_script_of_a_node_is_one_that_tells() -> None:
    """Else --help would start it, and wait for a master."""
    scripts = [file for file in ROOT.glob("src/*/nodes/*") if file.is_file()]
    told = {f"{package}/nodes/{name}" for package, name, _ in nodes()}
    for file in scripts:
        source = Path(str(importlib.util.find_spec(started_by(file)).origin)).read_text("utf-8")
        assert "with starting(" not in source or str(file.relative_to(ROOT / "src")) in told, file


@pytest.mark.thorough
@pytest.mark.parametrize(("package", "name"), list(executables()))
def test_rosrun_prints_help_and_starts_nothing(package: str, name: str, tmp_path: Path) -> None:
    """Exit code 0 without a ROS master, at once, and nothing is written there."""
    here = tmp_path / "here"
    here.mkdir()
    env = workspace_environment() | {
        "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
        "ROS_HOME": str(tmp_path),
        "HOME": str(tmp_path),
        "COLUMNS": "200",
    }
    done = subprocess.run(
        [ROSRUN, package, name, "--help"],
        env=env,
        cwd=here,
        capture_output=True,
        text=True,
        timeout=30.0,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "usage" in done.stdout.lower(), done.stdout
    assert "Traceback" not in done.stderr, done.stderr
    assert list(here.iterdir()) == []
    for module in [module for *node, module in nodes() if node == [package, name]]:
        assert done.stdout.strip() == help_of(module).strip()
