"""The set-up's steps, run in bash with stand-ins for apt-get, dpkg, pip and catkin."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest
from harness.workspace import ROOT

SOURCES = "for f in environment steps machine install checks; do source setup/$f.sh; done"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Give a small copy of the workspace without anything installed or built."""
    root = tmp_path / "cell"
    shutil.copytree(ROOT / "setup", root / "setup")
    shutil.copytree(ROOT / ".ci", root / ".ci")
    for name in ("cell", "env.sh"):
        shutil.copy(ROOT / name, root)
    package = root / "src" / "example"
    (package / "nodes").mkdir(parents=True)
    shutil.copy(ROOT / "CMakeLists.txt", root)
    (root / "config").mkdir()
    (package / "package.xml").write_text("<package/>")
    (package / "code.py").write_text("")
    return root


def bash(
    root: Path, script: str, env: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a script in ``root`` with the set-up's functions sourced."""
    whole = f"set -uo pipefail; root=$PWD; logs=$PWD/logs; mkdir -p logs; {SOURCES}\n{script}"
    return subprocess.run(
        ["bash", "-c", whole],
        cwd=root,
        env={**os.environ, **(env or {})},
        capture_output=True,
        text=True,
        timeout=30,
    )


def test_step_shows_its_title_and_time(tree: Path) -> None:
    """One line for each step; what it prints goes to its log."""
    done = bash(tree, 'run_step 1/3 "A title" logs/a.log "Advice." bash -c "echo inside"')
    assert re.fullmatch(r"\[1/3\] A title \.\.\. \d+ s\n", done.stdout)
    assert (tree / "logs/a.log").read_text() == "inside\n"


def test_failing_step_is_named_with_its_last_lines_and_advice(tree: Path) -> None:
    """A person sees which step it was, what it said, and what to do; the exit code is not 0."""
    done = bash(
        tree,
        'run_step 2/3 "A title" logs/a.log "Do this." bash -c "seq 100; false"; echo not reached',
    )
    assert done.returncode == 1 and "not reached" not in done.stdout
    assert 'step "A title" failed. Do this.' in done.stderr
    assert (
        "    100\n" in done.stderr and "    76\n" in done.stderr and "    75\n" not in done.stderr
    )


@pytest.mark.parametrize(
    ("release", "architecture", "text"),
    [
        (
            'ID=ubuntu\nVERSION_ID="24.04"\nPRETTY_NAME="Ubuntu 24.04"',
            "amd64",
            r"needs Debian 12.*runs Ubuntu 24\.04",
        ),
        (
            'ID=debian\nVERSION_ID="13"\nPRETTY_NAME="Debian 13"',
            "amd64",
            r"needs Debian 12.*runs Debian 13",
        ),
        ("", "amd64", r"needs Debian 12.*an unknown system"),
        ('ID=debian\nVERSION_ID="12"', "arm64", r"needs an amd64 machine.*this one is arm64"),
    ],
)
def test_other_machines_are_refused_with_a_sentence(
    tree: Path, release: str, architecture: str, text: str
) -> None:
    """Before anything is installed."""
    (tree / "release").write_text(release)
    done = bash(
        tree,
        f"os_release=release; dpkg() {{ echo {architecture}; }}; check_machine; echo not reached",
    )
    assert done.returncode == 1 and "not reached" not in done.stdout
    assert re.search(text, done.stderr), done.stderr


def test_debian_12_on_amd64_is_accepted(tree: Path) -> None:
    """The machine this is made for."""
    (tree / "release").write_text('ID=debian\nVERSION_ID="12"')
    done = bash(tree, "os_release=release; dpkg() { echo amd64; }; check_machine && echo fine")
    assert done.stdout == "fine\n", done.stderr


@pytest.mark.parametrize(
    ("name", "odd"), [("my cell", " "), ("cell;1", ";"), ("a'b", "'"), ("a:b", ":"), ("a$b", "$")]
)
def test_path_that_catkin_cannot_build_in_is_refused_at_once(
    tmp_path: Path, name: str, odd: str
) -> None:
    """The text shows the character; nothing has been installed by then."""
    root = tmp_path / name
    shutil.copytree(ROOT / "setup", root / "setup")
    shutil.copy(ROOT / "cell", root)
    done = subprocess.run([str(root / "cell"), "build"], capture_output=True, text=True, timeout=30)
    assert done.returncode == 1
    assert f'the path holds "{odd}"' in done.stderr
    assert not (root / ".venv").exists() and not (root / "build").exists()


def test_too_long_path_is_refused(tree: Path) -> None:
    """The kernel cuts the first line of a script that names its interpreter."""
    done = bash(tree, f"root=/{'x' * 200}; check_folder")
    assert done.returncode == 1 and "201 characters long" in done.stderr


DPKG = """
mkdir -p fake
cat > fake/dpkg-query <<'END'
#!/bin/bash
for package in "$@"; do
  case $package in
    catkin | cmake) echo "$package=${VERSION:-1.0} installed" ;;
    rosbash) echo "$package=1.0 config-files" ;;
  esac
done
END
chmod +x fake/dpkg-query
PATH="$PWD/fake:$PATH"
"""


def test_another_locale_asks_for_no_new_build(tree: Path) -> None:
    """Each sorts in its own order: two people at one workspace would build it again and again."""
    # As a locale of people does: not as C.
    odd = 'sort() { [ "$LC_ALL" = C ] || set -- "$@" -r; command sort "$@"; }'
    for name in ("a_node", "another"):
        (tree / "src/example/nodes" / name).write_text("")
    (tree / "src/example/setup.py").write_text("")
    script = f"{DPKG}\n{odd}\nbuild_inputs"
    one, other = [bash(tree, script, {"LC_ALL": name}).stdout for name in ("C", "C.UTF-8")]
    assert one == other and "src/example/nodes/another" in one


def test_missing_packages_are_those_not_fully_installed(tree: Path) -> None:
    """A removed package whose settings remain is missing; comments are no packages."""
    (tree / "setup/apt.txt").write_text("# ROS\ncatkin\nrosbash   # shell\ncmake\n\nmbpoll\n")
    assert bash(tree, f"{DPKG}\nmissing_packages").stdout.split() == ["rosbash", "mbpoll"]


def test_nothing_is_asked_of_apt_when_all_packages_are_there(tree: Path) -> None:
    """A second start takes no time and no root."""
    (tree / "setup/apt.txt").write_text("catkin\ncmake\n")
    done = bash(
        tree, f"{DPKG}\nid() {{ echo 1000; }}; apt-get() {{ echo called; }}; step_debian; echo done"
    )
    assert done.stdout == "done\n"


@pytest.mark.parametrize(
    ("failures", "calls"), [(0, ["install"]), (1, ["install", "update", "install"])]
)
def test_package_lists_are_updated_only_when_needed(
    tree: Path, failures: int, calls: list[str]
) -> None:
    """A first attempt that fails (no lists, old lists) is repeated once after an update."""
    fake = tree / "fake"
    fake.mkdir()
    (fake / "apt-get").write_text(
        '#!/bin/bash\necho "$1" >> calls\n[ "$1" = update ] || [ "$(grep -c install calls)" '
        '-gt "$FAILURES" ]\n'
    )
    (fake / "apt-get").chmod(0o755)
    done = bash(
        tree,
        'PATH="$PWD/fake:$PATH"; as_root() { "$@"; }; apt_install x y',
        {"FAILURES": str(failures)},
    )
    assert done.returncode == 0
    assert (tree / "calls").read_text().split() == calls


def test_missing_packages_without_root_and_sudo_are_told_with_the_command(tree: Path) -> None:
    """Somebody else with the rights can then do it."""
    (tree / "setup/apt.txt").write_text("catkin\nmbpoll\n")
    done = bash(
        tree,
        f"{DPKG}\nid() {{ echo 1000; }}; command() {{ return 1; }}; step_debian; echo not reached",
    )
    assert done.returncode == 1 and "not reached" not in done.stdout
    assert "no sudo. As root: apt-get install mbpoll" in done.stderr


VENV = """
make_venv() { echo made >> made; mkdir -p .venv/bin; ln -sf /bin/true .venv/bin/python; }
"""


@pytest.mark.parametrize(
    ("change", "made"),
    [
        ("true", 1),
        ("echo x==1 >> setup/requirements.txt", 2),
        ("echo x==1 >> setup/pins.txt", 2),
        ("rm -rf .venv", 2),
        ("rm .venv/bin/python", 2),
        ("cd ..; mv cell moved; cd moved; root=$PWD; logs=$root/logs; venv=$root/.venv", 2),
    ],
)
def test_libraries_are_installed_again_only_when_something_changed(
    tree: Path, change: str, made: int
) -> None:
    """Changed pins, a lost venv and a moved folder count; a second start does not."""
    done = bash(tree, f"{VENV}\nstep_python >&2; {change}\nstep_python >&2; wc -l < made")
    assert done.stdout.split() == [str(made)], done.stderr


def test_failed_installation_is_tried_again(tree: Path) -> None:
    """Only success is stamped."""
    bash(
        tree,
        "make_venv() { mkdir -p .venv/bin; ln -sf /bin/true .venv/bin/python; false; }; "
        "step_python",
    )
    done = bash(tree, f"{VENV}\nstep_python >/dev/null; cat made")
    assert done.stdout == "made\n"


def test_moved_venv_is_made_anew(tree: Path) -> None:
    """A venv knows its own path: its scripts would start another folder's interpreter, or none."""
    script = """
    mkdir -p .venv/bin; echo 'VIRTUAL_ENV=/elsewhere/.venv' > .venv/bin/activate; touch .venv/old
    sed -i "s#/usr/bin/python3 -m venv#bash fake_venv#" setup/install.sh; source setup/install.sh
    echo 'mkdir -p "$2/bin"; ln -s /bin/true "$2/bin/python"' > fake_venv
    make_venv; ls .venv/old
    """
    done = bash(tree, script)
    assert done.stdout == "", "the old one is gone"
    assert (tree / ".venv" / "CATKIN_IGNORE").exists(), done.stderr


BUILD = (
    f"{DPKG}\nbuild_workspace() {{ echo built >> built; mkdir -p build devel; touch "
    f"devel/setup.bash; }}"
)


@pytest.mark.parametrize(
    ("change", "builds"),
    [
        ("true", 1),
        ("echo 1 >> src/example/code.py", 1),
        ("touch src/example/package.xml", 1),
        ("echo '<!-- -->' >> src/example/package.xml", 2),
        ("echo '# ' >> CMakeLists.txt", 2),
        ("echo 'float64 x' > src/example/New.msg", 2),
        ("touch src/example/nodes/new_node", 2),
        ("rm -rf devel", 2),
        ("rm -rf build", 2),
        ("export VERSION=2.0", 2),
    ],
)
def test_workspace_is_built_again_only_when_an_input_changed(
    tree: Path, change: str, builds: int
) -> None:
    """Python modules are used from the source tree.

    Messages, manifests and node lists need a build.
    """
    done = bash(tree, f"{BUILD}\nstep_build >&2\n{change}\nstep_build >&2; wc -l < built")
    assert done.stdout.split() == [str(builds)], done.stderr


def test_build_on_demand_ignores_the_stamp(tree: Path) -> None:
    """`./cell build` builds."""
    done = bash(tree, f"{BUILD}\nstep_build >&2; step_build always >&2; wc -l < built")
    assert done.stdout.split() == ["2"]


def test_build_of_another_folder_is_thrown_away(tree: Path) -> None:
    """A copied or moved tree carries the old paths in its CMake cache."""
    script = """
    mkdir build devel; touch devel/old build/old
    echo 'CMAKE_HOME_DIRECTORY:INTERNAL=/elsewhere' > build/CMakeCache.txt
    cmake() { :; }; build_workspace; ls -d build/old devel
    """
    done = bash(tree, script)
    assert done.stdout == "", "the old ones are gone"


def test_messages_are_generated_without_what_pip_is_just_writing(tree: Path) -> None:
    """A library of .venv that is half there ends its reader with a bus error."""
    (tree / "load.py").write_text(
        "import sys; own = {*sys.modules}; import genpy\n"
        "print(*(n for n, m in sys.modules.items() if n not in own and '.venv' in str(m)))"
    )
    script = f"load() {{ {ROOT}/.venv/bin/python load.py; }}; cmake() {{ load; }}; load; "
    done = bash(tree, f"{script} build_workspace", {"PYTHONPATH": ""})
    before, *building = done.stdout.splitlines()
    assert "numpy" in before.split(), "else this would show nothing"
    assert building == ["", ""], done.stderr


def test_second_start_waits_for_the_first(tree: Path) -> None:
    """Two set-ups at once would install over each other."""
    stubs = (
        "check_machine() { :; }; step_debian() { :; }; step_venv() { :; }; step_python() { :; }; "
    )
    first = (
        f"{stubs} step_build() {{ touch busy; while [ ! -e go ]; do sleep 0.05; done; touch "
        f"first; }}; ensure_setup"
    )
    second = f"{stubs} step_build() {{ ls first; }}; ensure_setup"
    whole = f"set -uo pipefail; root=$PWD; {SOURCES}\n"
    with subprocess.Popen(["bash", "-c", whole + first], cwd=tree) as one:
        deadline = time.monotonic() + 10.0
        while not (tree / "busy").exists():
            assert time.monotonic() < deadline
        with subprocess.Popen(
            ["bash", "-c", whole + second], cwd=tree, stdout=subprocess.PIPE, text=True
        ) as two:
            assert two.stdout is not None
            assert "another ./cell is setting up; waiting" in two.stdout.readline()
            (tree / "go").touch()
            assert two.stdout.read() == "first\n"
        assert (one.wait(), two.wait()) == (0, 0)
