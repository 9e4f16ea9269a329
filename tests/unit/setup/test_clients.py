"""The environments of other people's programs, with stand-ins for pip, npm and apt-get."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from harness.workspace import ROOT

STAND_INS = """
apt_install() { echo "apt $*"; }
npm() { echo "npm $*"; }
install_python_client() { mkdir -p "$2"; echo "pip $(basename "$1")"; }
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Give a workspace with one client of each kind."""
    (tmp_path / "setup" / "clients").mkdir(parents=True)
    (tmp_path / "setup" / "clients" / "one.txt").write_text("one==1.0\n")
    (tmp_path / "setup" / "clients" / "two.json").write_text('{"dependencies": {"two": "2.0"}}\n')
    return tmp_path


def ensure(root: Path, before: str = "") -> subprocess.CompletedProcess[str]:
    """Make the environments."""
    script = f"root=$PWD; source {ROOT}/setup/clients.sh; {STAND_INS}\n{before}\nensure_clients"
    return subprocess.run(
        ["bash", "-uc", script], cwd=root, capture_output=True, text=True, timeout=30
    )


def test_each_client_is_installed_once(tree: Path) -> None:
    """Again only when its file has changed."""
    first = ensure(tree)
    assert first.returncode == 0, first.stderr
    assert "pip one.txt" in first.stdout and "npm install" in first.stdout
    assert (tree / ".venv/clients/two/package.json").read_text().startswith('{"dependencies"')
    assert ensure(tree).stdout == ""
    (tree / "setup/clients/one.txt").write_text("one==1.1\n")
    again = ensure(tree).stdout
    assert "pip one.txt" in again and "npm" not in again


def test_node_is_installed_where_there_is_none(tree: Path) -> None:
    """From Debian, and only for these clients."""
    found = ensure(tree, 'command() { [ "$2" != node ]; }').stdout
    assert "apt nodejs npm" in found
    assert "apt" not in ensure(tree, "rm -rf .venv; command() { true; }").stdout


def test_a_client_that_cannot_be_installed_ends_the_verb(tree: Path) -> None:
    """The next run tries again."""
    assert ensure(tree, "npm() { return 1; }").returncode == 1
    assert "npm install" in ensure(tree).stdout
