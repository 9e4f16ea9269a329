"""The install space: a prefix elsewhere is complete without the source tree's help."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.live_cell import LiveCell
from harness.workspace import ROOT

pytestmark = [pytest.mark.system, pytest.mark.thorough]


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build and install the workspace into a folder of its own."""
    folder = tmp_path_factory.mktemp("install")
    env = {"HOME": str(folder), "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8"}
    target = folder / "prefix"
    for command in (
        ["cmake", "-S", str(ROOT), "-B", str(folder / "build")]
        + [
            f"-DCMAKE_INSTALL_PREFIX={target}",
            f"-DCATKIN_DEVEL_PREFIX={folder / 'devel'}",
            f"-DPYTHON_EXECUTABLE={ROOT / '.venv/bin/python'}",
        ],
        ["cmake", "--build", str(folder / "build"), "--", "-j2"],
        ["cmake", "--install", str(folder / "build")],
    ):
        done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    return target


@pytest.fixture(scope="module")
def installed_env(prefix: Path) -> dict[str, str]:
    """Return the environment of a shell that has sourced the prefix only."""
    script = 'source "$1/setup.bash" >&2 && env -0'
    env = {
        "HOME": str(prefix),
        "PATH": "/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "ROS_IP": "127.0.0.1",
        "ROS_PYTHON_VERSION": "3",
    }
    done = subprocess.run(
        ["bash", "-c", script, "bash", str(prefix)],
        env=env,
        capture_output=True,
        timeout=30,
        check=True,
    )
    return dict(item.split("=", 1) for item in done.stdout.decode().split("\0") if "=" in item)


def test_packages_and_configuration_are_found_in_the_prefix(
    prefix: Path, installed_env: dict[str, str]
) -> None:
    """Modules, messages and YAML files come from there."""
    code = (
        "import scara_config, scara_control.kinematics.kinematics_server_node\n"
        "import fanuc_emulator.modbus, twin_controller.core, scara_msgs.srv\n"
        "print(scara_config.__file__); print(scara_control.__file__)\n"
        "print(scara_msgs.srv.__file__)\n"
        "print(scara_config.config_directory())\n"
    )
    done = subprocess.run(
        [str(ROOT / ".venv/bin/python"), "-c", code],
        env=installed_env,
        cwd="/",
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert done.returncode == 0, done.stderr
    places = done.stdout.split()
    assert len(places) == 4 and all(place.startswith(str(prefix)) for place in places), places
    shipped = {file.relative_to(ROOT / "config") for file in (ROOT / "config").rglob("*.yaml")}
    assert {file.relative_to(places[3]) for file in Path(places[3]).rglob("*.yaml")} == shipped


def test_every_node_of_the_source_space_is_in_the_prefix(prefix: Path) -> None:
    """With the interpreter of the build in its first line."""
    for script in ROOT.glob("src/*/nodes/*"):
        installed = prefix / "lib" / script.parent.parent.name / script.name
        assert installed.is_file() and os.access(installed, os.X_OK), installed
        assert installed.read_text().startswith(f"#!{ROOT}/.venv/bin/python"), installed


@pytest.fixture
def installed_cell(
    installed_env: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[LiveCell]:
    """Give a cell that runs from the prefix."""
    monkeypatch.setattr("harness.live_cell.workspace_environment", lambda: installed_env)
    cell = LiveCell(tmp_path)
    yield cell
    cell.close()


def test_whole_cell_runs_from_the_prefix(installed_cell: LiveCell, prefix: Path) -> None:
    """Every node is started by rosrun from there and moves."""
    bringup = installed_cell.start()
    installed_cell.wait_ready(bringup)
    command = Path(f"/proc/{bringup.pid}/cmdline").read_bytes().decode()
    assert str(prefix / "lib/scara_bringup/cell") in command
    answer = installed_cell.call("/move_to", "{x: 0.51, y: 0.16, z: 0.10}")
    assert answer["success"], answer
