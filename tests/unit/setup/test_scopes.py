"""What a cell needs and what tests need are set up apart."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from harness.workspace import ROOT
from unit.setup.test_setup import bash, tree

__all__ = ["tree"]


def test_a_cell_asks_for_less_than_its_tests(tree: Path) -> None:
    """No browser and no type checker for who only wants to see the robots move."""
    run, test = (
        set(bash(tree, f"scope={scope}; wanted_packages").stdout.split())
        for scope in ("run", "test")
    )
    tools = {"chromium-headless-shell", "mbpoll", "python3-pykdl", "catkin-lint"}
    assert run < test and tools <= test - run
    assert {"python3-rospy", "catkin"} <= run


def test_each_verb_sets_up_what_it_needs() -> None:
    """What continuous integration calls needs everything."""
    text = (ROOT / "cell").read_text()
    for verb in ("test", "bench", "check", "docs"):
        (body,) = re.findall(rf"^  {verb}\)(.*?);;", text, re.MULTILINE | re.DOTALL)
        assert body.index("scope=test") < body.index("ensure_setup"), verb
    (body,) = re.findall(r"^  farm\)(.*?);;", text, re.MULTILINE | re.DOTALL)
    assert body.index("scope=farm") < body.index("ensure_setup")
    verbs = r"^  demo \| up \| status \| why \| install\)(.*?);;"
    (body,) = re.findall(verbs, text, re.MULTILINE | re.DOTALL)
    assert re.findall(r"scope=\w+", body) == ["scope=farm"] and "--farm" in body


@pytest.mark.parametrize(
    ("before", "change", "count"),
    [
        ("", "", 2),
        ("scope=farm; ", "", 3),
        ("scope=test; ", "", 4),
        ("scope=farm; ", "echo '# new' >>setup/pins_farm.txt", 1),
        ("scope=test; ", "echo '# new' >>setup/pins_test.txt", 1),
        ("", "echo '# new' >>setup/pins_test.txt", 0),
    ],
    ids=["run", "farm", "test", "changed for the farm", "changed", "changed for tests only"],
)
def test_libraries_of_the_tests_are_installed_beside_and_once(
    tree: Path, before: str, change: str, count: int
) -> None:
    """A cell never waits for what only tests have changed."""
    install = (
        "run_step() { echo installed; mkdir -p $venv/bin; touch $venv/bin/python; "
        "chmod +x $venv/bin/python; }; "
    )
    first = f"{install}{before}step_venv; step_python; step_more_libraries"
    done = bash(tree, first)
    if change:
        done = bash(tree, f"{change}; {first}")
    assert done.stdout.count("installed") == count, done.stdout + done.stderr
    assert bash(tree, first).stdout.count("installed") == 0


@pytest.mark.parametrize(
    ("ends", "code"),
    [
        ({}, 0),
        ({"step_python": "exit 1"}, 1),
        ({"step_more_libraries": "exit 1"}, 1),
        ({"step_build": "exit 2"}, 2),
    ],
    ids=lambda ends: next(iter(ends), "all well") if isinstance(ends, dict) else "",
)
def test_build_and_libraries_are_made_beside_each_other(
    tree: Path, ends: dict[str, str], code: int
) -> None:
    """Each waits for the others here; what cannot be made ends the set-up with its reason."""
    meet = "touch $1; for k in $(seq 100); do [ -e $2 ] && return; sleep 0.1; done; exit 3"
    steps = (
        f"check_machine() {{ :; }}; step_debian() {{ :; }}; meet() {{ {meet}; }}; "
        "step_venv() { touch venv; }; step() { echo made $1; ${ends[$1]:-true}; }; "
        "step_python() { [ $scope = run ] && meet a b && meet c d; step step_python; }; "
        "step_more_libraries() { [ -e venv ] && meet b a && meet e f; step step_more_libraries; }; "
        "step_build() { [ -e venv ] && meet d c && meet f e; step step_build; }; "
        f"declare -A ends=({' '.join(f'[{name}]={end!r}' for name, end in ends.items())}); "
        "scope=test; ensure_setup && echo done"
    )
    done = bash(tree, steps)
    assert done.returncode == code, done.stderr
    assert ("done" in done.stdout) == (code == 0)
    said = done.stderr if code else done.stdout
    assert {"made step_build", "made step_more_libraries"} <= set(said.splitlines())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "name a folder for the machine"),
        ("FOLDER", "was not made by this script"),
    ],
)
def test_the_fresh_machine_is_made_where_nothing_is_lost(
    tree: Path, tmp_path: Path, words: str, said: str
) -> None:
    """A folder of a person is never emptied."""
    folder = tmp_path / "of_a_person"
    folder.mkdir()
    (folder / "precious").write_text("x")
    command = f"setup/fresh_machine.sh {words.replace('FOLDER', str(folder))}"
    pretended = "debootstrap() { :; }; id() { echo 0; }; export -f debootstrap id; "
    done = bash(tree, f"{pretended}{command}")
    assert done.returncode == 1 and said in done.stderr, done.stderr
    assert (folder / "precious").read_text() == "x"


def test_the_container_holds_what_a_cell_needs() -> None:
    """And nothing of this folder's own builds."""
    text = (ROOT / "setup" / "Containerfile").read_text()
    assert "FROM debian:12" in text and "./cell setup run" in text
    ignored = (ROOT / ".dockerignore").read_text().split("\n")
    assert {".venv", "build", "devel", "runs"} <= set(ignored)


def test_what_the_container_keeps_is_of_its_own_user() -> None:
    """An empty volume gets the owner of the image's folder; one of the host has another owner."""
    page = (ROOT / "docs" / "operating" / "machines.md").read_text()
    kept = re.search(r"--volume [a-z-]+:/cell/(\w+)", page)
    of_user = (ROOT / "setup" / "Containerfile").read_text().partition("USER cell")[2]
    assert kept is not None and f"mkdir -p {kept[1]}" in of_user


def test_the_container_runs_without_a_way_to_become_root() -> None:
    """A page or a node that is taken over stays a user; Debian's packages come before that."""
    text = (ROOT / "setup" / "Containerfile").read_text()
    lines = [line for line in text.split("\n") if not line.startswith("#")]
    assert not [line for line in lines if "sudo" in line or "NOPASSWD" in line]
    assert [line.split()[1] for line in lines if line.startswith("USER")] == ["cell"]
    asked = subprocess.run(
        ["/bin/sh", "-c", "sed 's/#.*//' setup/apt.txt | xargs echo"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "sed 's/#.*//' /tmp/apt.txt" in text
    listed = (ROOT / "setup" / "apt.txt").read_text().split("\n")
    wanted = [line.split("#")[0].strip() for line in listed]
    assert asked.stdout.split() == [name for name in wanted if name]
