"""The environments of other people's programs, with stand-ins for pip, npm and apt-get."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from harness.workspace import ROOT

STAND_INS = """
apt_install() { echo "apt $*"; }
npm() { echo "npm $*"; }
install_libraries() { echo "pip $*"; }
catkin_make() { echo "catkin_make $*"; }
env() { shift 3; "$@"; }
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
        ["bash", "-uc", script], cwd=root, capture_output=True, text=True, timeout=200
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


def test_a_client_that_cannot_be_installed_fails_the_verb_and_hinders_no_other(tree: Path) -> None:
    """The next run tries it again, and it alone."""
    failed = ensure(tree, "install_python_client() { return 1; }")
    assert failed.returncode == 1 and "one cannot be installed here" in failed.stderr
    assert "npm install" in failed.stdout
    again = ensure(tree)
    assert again.returncode == 0
    assert "pip one.txt" in again.stdout and "npm" not in again.stdout


@pytest.fixture
def repository(tree: Path) -> str:
    """Give the workspace a client in a repository, and return the commit that it wants."""
    source = tree / "three"
    git = ("git", "-C", str(source), "-c", "user.name=x", "-c", "user.email=x@example.org")
    subprocess.run(["git", "init", "--quiet", str(source)], check=True)
    for text in ("wanted", "newer"):
        (source / "package.xml").write_text(text)
        subprocess.run([*git, "add", "."], check=True)
        subprocess.run([*git, "commit", "--quiet", "-m", text], check=True)
    told = subprocess.run([*git, "rev-parse", "HEAD~1"], capture_output=True, text=True, check=True)
    commit = told.stdout.strip()
    lines = f"# Debian: libthree-that-is-nowhere\n# PyPI: four==4.0\n{source} {commit}\n"
    (tree / "setup" / "clients" / "workspace.git").write_text(lines)
    return commit


@pytest.mark.thorough
def test_a_workspace_is_built_from_the_commit_that_is_named(tree: Path, repository: str) -> None:
    """With what it needs of Debian, and once."""
    first = ensure(tree)
    assert first.returncode == 0, first.stderr
    assert "apt libthree-that-is-nowhere" in first.stdout
    folder = tree / ".venv" / "clients" / "workspace"
    assert (folder / "src" / "three" / "package.xml").read_text() == "wanted"
    assert "/venv/bin/python four==4.0" in first.stdout
    assert f"catkin_make -C {folder}" in (folder / "build.log").read_text()
    assert f"PYTHON_EXECUTABLE={folder}/venv/bin/python" in (folder / "build.log").read_text()
    assert ensure(tree).stdout == ""


def test_a_workspace_that_is_not_built_shows_why(tree: Path, repository: str) -> None:
    """The last lines of the build, and a failed verb; so does a repository that is not there."""
    wanted = tree / "setup" / "clients" / "workspace.git"
    wanted.write_text(wanted.read_text().replace("# PyPI: four==4.0\n", ""))
    failed = ensure(tree, "catkin_make() { echo no compiler; return 1; }")
    assert failed.returncode == 1 and "no compiler" in failed.stderr
    (tree / "three").rename(tree / "elsewhere")
    assert ensure(tree).returncode == 1


def test_page_of_the_project_has_a_result_for_each_version_that_is_tried() -> None:
    """A new version, or a new check, is run before it is shipped."""
    text = (ROOT / "docs" / "clients.md").read_text(encoding="utf-8")
    heads = "".join(line for line in text.splitlines() if line.startswith("| check |"))
    for file in sorted((ROOT / "setup" / "clients").iterdir()):
        if file.suffix == ".git":
            continue  # a second opinion on ours: no client, so the page has no column for it
        content = file.read_text(encoding="utf-8")
        if file.suffix == ".json":
            pins = list(json.loads(content)["dependencies"].items())
        else:
            pins = [(n, v) for n, _, v in (line.partition("==") for line in content.split()) if v]
        (name, version), *_ = pins  # the client; what follows is what it needs
        assert f"| {name} {version} |" in heads, f"{file.name}: run ./cell test --clients"
