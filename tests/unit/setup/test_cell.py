"""./cell and env.sh as a person meets them: verbs, any folder, any environment."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from harness.processes import wait_until
from harness.workspace import ROOT

VERBS = re.findall(
    r"^  ([a-z]+(?: \| [a-z]+)*)(?: \| -\S+)*\)", (ROOT / "cell").read_text(), re.MULTILINE
)
FOREIGN = {
    "OPENBLAS_NUM_THREADS": "2",
    "PYTHONPATH": "/opt/ros/other/lib/python3.8/site-packages",
    "PYTHONHOME": "/nowhere",
    "VIRTUAL_ENV": "/somebody/venv",
    "CMAKE_PREFIX_PATH": "/opt/ros/other",
    "ROS_PACKAGE_PATH": "/opt/ros/other/share",
    "ROS_DISTRO": "noetic",
    "ROS_VERSION": "2",
    "LD_LIBRARY_PATH": "/opt/ros/other/lib",
    "AMENT_PREFIX_PATH": "/opt/ros/other",
}


def run(
    *command: str, cwd: Path | None = None, env: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    return subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("word", [[], ["help"], ["--help"]])
def test_help_lists_every_verb(word: list[str]) -> None:
    """It needs no set-up."""
    done = run(str(ROOT / "cell"), *word)
    assert done.returncode == 0
    shown = {line.split()[0] for line in done.stdout.splitlines() if re.match("  [a-z]", line)}
    assert shown == {verb for verbs in VERBS for verb in verbs.split(" | ")}
    assert max(map(len, done.stdout.splitlines())) <= 80, "as wide as a terminal is at first"


@pytest.mark.parametrize("verb", ["test", "check", "build", "setup", "docs", "clean"])
@pytest.mark.parametrize("word", ["--help", "-h"])
def test_help_of_a_verb_starts_nothing(verb: str, word: str, tmp_path: Path) -> None:
    """It says what the verb does, in a copy that has neither set-up nor build."""
    shutil.copy(ROOT / "cell", tmp_path)
    shutil.copytree(ROOT / "setup", tmp_path / "setup")
    before = sorted(tmp_path.rglob("*"))
    done = run(str(tmp_path / "cell"), verb, word)
    assert done.returncode == 0 and not done.stderr
    assert {line.split()[0] for line in done.stdout.splitlines() if line[2] != " "} == {verb}
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(("verb", "near"), [("dmo", "demo"), ("tets", "test"), ("xyzzy", "")])
def test_unknown_verb_is_refused_with_the_nearest_one(verb: str, near: str) -> None:
    """One line, and the exit code 2, as for every wrong use."""
    done = run(str(ROOT / "cell"), verb)
    hint = f"did you mean {near}? " if near else ""
    assert done.returncode == 2 and not done.stdout
    assert done.stderr == f'cell: there is no verb "{verb}"; {hint}./cell help lists all\n'


def test_cell_works_through_a_symbolic_link_from_any_folder(tmp_path: Path) -> None:
    """The link is followed to the workspace."""
    (tmp_path / "link").symlink_to(ROOT / "cell")
    assert run(str(tmp_path / "link"), "help", cwd=Path("/")).returncode == 0


@pytest.mark.parametrize(("script", "words"), [("run", "test"), ("nightly", "test --nightly")])
def test_machines_call_cell_test_and_nothing_else(tmp_path: Path, script: str, words: str) -> None:
    """What they do by day and by night, everybody can do."""
    shutil.copytree(ROOT / ".ci", tmp_path / ".ci")
    (tmp_path / "cell").write_text('#!/bin/bash\necho "cell:$*:$PWD"; exit 7\n')
    (tmp_path / "cell").chmod(0o755)
    done = run(str(tmp_path / ".ci" / script), cwd=Path("/"))
    assert (done.stdout, done.returncode) == (f"cell:{words}:{tmp_path}\n", 7)


def shell(
    script: str, env: dict[str, str] | None = None, cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a bash script in an almost empty environment."""
    base = {"HOME": "/nonexistent", "PATH": "/usr/bin:/bin"}
    return run("bash", "--norc", "-c", script, cwd=cwd, env={**base, **(env or {})})


def test_tests_and_measurements_listen_at_this_machine_only() -> None:
    """An address in the user's shell opened every node of every test."""
    text = (ROOT / "cell").read_text()
    (function,) = re.findall(r"^stay_on_loopback\(\) \{.*?^\}", text, re.MULTILINE | re.DOTALL)
    foreign = {"ROS_IP": "192.168.1.5", "ROS_HOSTNAME": "cell-7"}
    done = shell(f'{function}\nstay_on_loopback\necho "$ROS_IP|${{ROS_HOSTNAME-none}}"', foreign)
    assert done.stdout == "127.0.0.1|none\n"
    for verb in ("test", "bench"):
        (body,) = re.findall(rf"^  {verb}\)(.*?);;", text, re.MULTILINE | re.DOTALL)
        assert "stay_on_loopback" in body


OF_THE_RUN = ("CELL_TEST_PART", "CELL_TEST_NODES", "CELL_TEST_TURN", "HYPOTHESIS_SEARCH")


def asked(**more: str) -> dict[str, str]:
    """Return the environment without the part that this very test belongs to."""
    own = {name: value for name, value in os.environ.items() if name not in OF_THE_RUN}
    return {**own, "SLEEPS": "-", **more}


def says(root: Path, script: str) -> None:
    """Let the Python of a workspace be a script that says what it is asked."""
    python = root / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True, exist_ok=True)
    python.write_text(f"#!/bin/bash\n{script}")
    python.chmod(0o755)


@pytest.fixture
def parts(tmp_path: Path) -> str:
    """Give a script that runs the tests of a workspace whose Python says what it is asked."""
    says(
        tmp_path,
        'echo "${CELL_TEST_PART:-named} $(ps -o nice= -p $$ | tr -d " "): $*"\n'
        'echo $$ >"pid_${CELL_TEST_PART:-named}"\n'
        '[ "$CELL_TEST_PART" != "$SLEEPS" ] || exec sleep 1000\n'
        '[ "$CELL_TEST_PART" != "${HEARS:--}" ] || kill -INT $PPID\n'
        '[ "$CELL_TEST_PART" != "${FAILS% *}" ] || exit "${FAILS#* }"\n',
    )
    (tmp_path / "build").mkdir()
    (tmp_path / "some_test.py").touch()
    text = (ROOT / "cell").read_text()
    found = re.findall(r"^(?:run_tests|beside|behind|end_beside)\(\) \{.*?^\}", text, re.M | re.S)
    assert len(found) == 4
    return "\n".join([f"root={tmp_path}; cd $root; set -u", *found, 'run_tests "$@"'])


@pytest.mark.parametrize("nodes", ["", "beside"])
def test_the_whole_is_tested_in_seven_parts(parts: str, nodes: str) -> None:
    """What only computes takes what the others leave, and all that it is asked for reaches each."""
    done = run("bash", "-c", parts, "cell", "-k", "x", env=asked(CELL_TEST_NODES=nodes))
    assert done.returncode == 0, done.stderr
    found = re.findall(
        r"^(\w+) (\d+): -m pytest (-n \d) --junitxml=build/test_\1.xml (.*)$", done.stdout, re.M
    )
    usual = "--no-loadscope-reorder -m not thorough -k x"
    own = os.nice(0)
    assert found == [
        ("cells", str(own), "-n 0", usual),
        ("nodes", str(min(19, own + 5) if nodes else own), "-n 3", usual),
        ("starts", str(own), "-n 2", usual),
        ("more_pages", str(own), "-n 0", usual),
        ("pages", str(own), "-n 0", usual),
        ("pure", "19", "-n 0", usual),
        ("more_pure", "19", "-n 0", usual),
    ]


def test_by_night_what_only_computes_comes_behind_all_that_is_live(
    parts: str, tmp_path: Path
) -> None:
    """A live scene has the machine; a search may take an hour, two workers share the longest."""
    with (tmp_path / ".venv" / "bin" / "python").open("a") as python:
        python.write('echo "$CELL_TEST_PART" >>build/ended\n')
    done = run("bash", "-c", parts, env=asked(HYPOTHESIS_SEARCH="1"))
    ended = (tmp_path / "build" / "ended").read_text().split()
    assert set(ended[-2:]) == {"pure", "more_pure"} and len(ended) == 7
    patient = re.findall(
        r"^(\w+) \d+: .* -o timeout=3600 -o faulthandler_timeout=3590$", done.stdout, re.M
    )
    assert patient == ["pure", "more_pure"]
    assert re.findall(r"^(\w*pure) 19: -m pytest -n (\d)", done.stdout, re.M) == [
        ("pure", "0"),
        ("more_pure", "2"),
    ]


@pytest.mark.parametrize(("nodes", "beside"), [("beside", True), ("", False)])
def test_single_nodes_run_beside_cells_on_request_and_never_beside_a_browser(
    parts: str, tmp_path: Path, nodes: str, beside: bool
) -> None:
    """Beside a node of another worker a browser stopped going on.

    Here nodes wait for pages in vain, and starts and more pages do not.
    """
    (tmp_path / "build" / "ended").write_text("")
    says(
        tmp_path,
        '[ "$CELL_TEST_PART" != cells ] || for _ in {1..100}; do\n'
        f"  grep -q nodes build/ended && break; {'sleep 0.1' if beside else 'break'}\n"
        "done\n"
        "for part in nodes:5 starts:100 more_pages:100; do\n"
        '  [ "$CELL_TEST_PART" != ${part%:*} ] || for ((k = 0; k < ${part#*:}; k++)); do\n'
        "    grep -q pages build/ended && break; sleep 0.1\n"
        "  done\n"
        "done\n"
        'echo "$CELL_TEST_PART" >>build/ended\n',
    )
    assert run("bash", "-c", parts, env=asked(CELL_TEST_NODES=nodes)).returncode == 0
    said = (tmp_path / "build" / "ended").read_text().split()
    ended = [part for part in said if part not in ("pure", "more_pure")]
    before = ["nodes", "cells"] if beside else ["cells", "nodes"]
    assert ended == [*before, "pages", "starts", "more_pages"], (
        "they wait for the pages beside them"
    )


@pytest.mark.parametrize(
    ("part", "code"),
    [("cells", 1), ("starts", 2), ("nodes", 1), ("pages", 2), ("more_pages", 1), ("more_pure", 1)],
)
def test_a_part_that_fails_fails_the_whole(parts: str, part: str, code: int) -> None:
    """The others are run and shown all the same; 2 is a test file that cannot be read, too."""
    done = run("bash", "-c", parts, env=asked(FAILS=f"{part} {code}"))
    assert done.returncode == code and f"a part failed ({code})" in done.stderr
    shown = re.findall(r"^(\w+) \d+:", done.stdout, re.M)
    assert shown == ["cells", "nodes", "starts", "more_pages", "pages", "pure", "more_pure"]


def test_an_interrupted_run_ends_what_runs_beside_it(parts: str, tmp_path: Path) -> None:
    """Ctrl-C reaches the part that is seen."""
    env = asked(FAILS="cells 2", HEARS="cells", SLEEPS="pure")
    begun = "cells() { until [ -s pid_pure ]; do sleep 0.05; done; }\n"
    waiting = parts.replace('"${command[@]}" ||', 'cells; "${command[@]}" ||')
    # What is started in the background ignores Ctrl-C, and so does all that it starts.
    done = run("env", "--default-signal=INT", "bash", "-c", begun + waiting, env=env)
    assert done.returncode == 2 and "nodes" not in done.stdout
    pid = int((tmp_path / "pid_pure").read_text())
    wait_until(lambda: not Path(f"/proc/{pid}").exists(), 10.0, "the end of the pure part")


@pytest.mark.parametrize(("fails", "code"), [("none", 0), ("tests/core.py", 1), ("tests/unit", 1)])
def test_a_change_runs_what_it_reaches_beside_what_always_runs(
    tmp_path: Path, fails: str, code: int
) -> None:
    """A live core, then what the change reaches, quick tests beside both; all are run."""
    says(
        tmp_path,
        'case "$*" in\n'
        '  *running.changed\\ HEAD~3) echo "tests/a.py"; echo "tests/b.py" ;;\n'
        '  -c*) echo "tests/core.py" ;;\n'
        f'  *) echo "ran $*"; [[ "$*" != *{fails}* ]] ;;\n'
        "esac\n",
    )
    (tmp_path / "tests").mkdir()
    (tmp_path / "build").mkdir()
    names = r"^(?:run_changed|beside|behind|end_beside)\(\) \{.*?^\}"
    functions = "\n".join(re.findall(names, (ROOT / "cell").read_text(), re.M | re.S))
    script = f"root={tmp_path}; cd $root; set -u\n{functions}\nrun_changed HEAD~3"
    done = run("bash", "-c", script, env=asked())
    ran = [line.split() for line in done.stdout.splitlines() if line.startswith("ran")]
    assert [words[-2:] for words in ran] == [
        ["thorough", "tests/core.py"],
        ["tests/a.py", "tests/b.py"],
        *[["tests/golden", "tests/unit"]] * 2,
    ]
    assert done.returncode == code


def test_named_tests_run_in_one_process(parts: str) -> None:
    """As they always did."""
    done = run("bash", "-c", parts, "cell", "some_test.py", env=asked())
    assert re.findall(r"^(\w+) \d+: (.*)$", done.stdout, re.M) == [
        ("named", "-m pytest some_test.py")
    ]


def test_sourced_environment_knows_the_workspace_without_any_variable_set(tmp_path: Path) -> None:
    """A fresh login has no ROS variables."""
    done = shell(
        f'source "{ROOT}/env.sh" && rospack find scara_config && echo "$ROS_MASTER_URI $ROS_IP"',
        cwd=tmp_path,
    )
    assert done.stdout.split() == [
        str(ROOT / "config"),
        "http://127.0.0.1:11311",
        "127.0.0.1",
    ], done.stderr


def test_arithmetic_of_small_matrices_takes_one_thread() -> None:
    """What a second one wins here it loses, and a busy machine makes it ten times as slow."""
    done = shell(f'source "{ROOT}/env.sh" && echo $OPENBLAS_NUM_THREADS', FOREIGN)
    assert done.stdout.split() == ["1"], done.stderr


def test_foreign_variables_do_not_leak_in() -> None:
    """Another ROS, an activated venv and a foreign library path are forgotten."""
    done = shell(
        f'source "{ROOT}/env.sh" && env && python3 -c "import rospy, scara_msgs.srv"', FOREIGN
    )
    assert done.returncode == 0, done.stderr
    assert (
        "/opt/ros/other" not in done.stdout
        and "/somebody" not in done.stdout
        and "/nowhere" not in done.stdout
    )


def test_another_python_first_on_path_does_not_matter(tmp_path: Path) -> None:
    """Debian's ROS tools find Debian's python3."""
    fake = tmp_path / "python3"
    fake.write_text("#!/bin/bash\necho wrong python; exit 1\n")
    fake.chmod(0o755)
    env = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    done = shell(f'source "{ROOT}/env.sh" && command -v python3 && rosnode --help', env)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("/usr/bin/python3\n") and "wrong python" not in done.stdout


def test_choices_of_the_user_stay() -> None:
    """Master, address and namespace are the user's; ROS_IP is not set beside a ROS_HOSTNAME."""
    env = {
        "ROS_MASTER_URI": "http://10.0.0.7:11311",
        "ROS_HOSTNAME": "here",
        "ROS_NAMESPACE": "cell_2",
    }
    done = shell(
        f'source "{ROOT}/env.sh"; echo "$ROS_MASTER_URI $ROS_HOSTNAME $ROS_NAMESPACE '
        f'${{ROS_IP:-none}}"',
        env,
    )
    assert done.stdout.split() == ["http://10.0.0.7:11311", "here", "cell_2", "none"]


def test_environment_of_an_unbuilt_workspace_says_what_to_do(tmp_path: Path) -> None:
    """Sourcing it does not end the shell."""
    shutil.copy(ROOT / "env.sh", tmp_path)
    done = shell(f'source "{tmp_path}/env.sh"; echo "code $?"')
    assert "run ./cell build" in done.stderr
    assert done.stdout == "code 1\n"


def test_environment_can_be_sourced_twice() -> None:
    """Nothing piles up."""
    once = shell(f'source "{ROOT}/env.sh"; echo "$PYTHONPATH $CMAKE_PREFIX_PATH $ROS_PACKAGE_PATH"')
    twice = shell(
        f'source "{ROOT}/env.sh"; source "{ROOT}/env.sh"; echo "$PYTHONPATH '
        '$CMAKE_PREFIX_PATH $ROS_PACKAGE_PATH"'
    )
    assert once.stdout == twice.stdout


def test_user_site_packages_are_left_out() -> None:
    """A library in ~/.local must not stand in front of a pinned one."""
    done = shell(
        f'source "{ROOT}/env.sh"; "{ROOT}/.venv/bin/python" -c "import site; '
        'print(site.ENABLE_USER_SITE)"'
    )
    assert done.stdout == "False\n"


def test_this_process_runs_in_the_venv_of_the_workspace() -> None:
    """./cell test uses the interpreter of the nodes."""
    import sys

    assert Path(sys.prefix) == ROOT / ".venv"
    assert os.path.realpath(sys.executable).startswith("/usr/bin/python3")
