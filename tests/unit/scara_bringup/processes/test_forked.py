"""Nodes as forks of one process: each is a program of its own in all that matters."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.processes import is_alive, wait_until
from scara_bringup.plan import NodePlan
from scara_bringup.processes.forked_io import WarmParent, WarmParentError, runs_here
from scara_bringup.processes.processes_io import Processes


@pytest.fixture(scope="module")
def warm() -> Iterator[WarmParent]:
    """Return a parent that has loaded."""
    with WarmParent({**os.environ, "PYTHONUNBUFFERED": "1", "OF_ALL": "children"}) as parent:
        yield parent


@pytest.fixture
def processes(warm: WarmParent, tmp_path: Path) -> Iterator[Processes]:
    """Return the children of a bring-up."""
    with Processes(tmp_path / "log", os.environ, warm) as found:
        yield found


def script(folder: Path, *lines: str) -> str:
    """Write a Python program and return its path."""
    file = folder / "a_node"
    file.write_text("\n".join([f"#!{sys.executable}", *lines, ""]))
    file.chmod(0o755)
    return str(file)


def plan(program: str, *arguments: str) -> NodePlan:
    """Plan a program."""
    return NodePlan("a_node", "", program, arguments)


def lines_of(processes: Processes) -> list[str]:
    """Wait for the end of the program and return what it has printed."""
    wait_until(processes.ended, 20.0, "the end of the program")
    return processes.last_lines("a_node", 100)


def test_a_forked_program_has_arguments_environment_session_and_log_of_its_own(
    processes: Processes, tmp_path: Path
) -> None:
    """What it shares with the others is memory alone."""
    program = script(
        tmp_path,
        "import json, os, sys, rospy",
        "files = [os.readlink(f'/proc/self/fd/{n}') for n in sorted(os.listdir('/proc/self/fd'))",
        "         if os.path.exists(f'/proc/self/fd/{n}')]",
        "words = open('/proc/self/cmdline').read().rstrip(chr(0)).split(chr(0))",
        "print(json.dumps([__name__, sys.argv, os.environ['OF_ALL'], words, files[:3], len(files),",
        "    os.getsid(0) == os.getpid(), sys.path[0], open('/proc/self/comm').read().strip(),",
        "    rospy.names.get_mappings()]))",
        "print('no line feed at the end', file=sys.stderr, end='')",
    )
    pid = processes.start(plan(program, "_rate:=25", "real:=other"))
    *_, said, last = lines_of(processes)
    name, argv, value, words, files, count, leads, path, comm, mappings = json.loads(said)
    assert (name, value, leads, comm) == ("__main__", "children", True, "a_node")
    assert argv == [program, "_rate:=25", "real:=other"]
    assert words == [sys.executable, *argv]
    assert files == [os.devnull, str(processes.log_of("a_node")), str(processes.log_of("a_node"))]
    assert count <= 4  # the fourth lists the others
    assert path == str(tmp_path)
    assert mappings == {"real": "other"}
    assert last == "no line feed at the end"
    assert pid == processes.pids()["a_node"]


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("pass", 0, ""),
        ("import sys; sys.exit(2)", 2, ""),
        ("import sys; sys.exit('why')", 1, "why"),
        ("raise RuntimeError('a fault')", 1, "RuntimeError: a fault"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", -9, ""),
        ("import atexit; atexit.register(print, 'last words')", 0, "last words"),
        ("import threading as t; t.Timer(0.05, print, ['late thread']).start()", 0, "late thread"),
    ],
)
def test_a_forked_program_ends_like_any_other(
    processes: Processes, tmp_path: Path, line: str, code: int, said: str
) -> None:
    """Exit code, traceback, what is registered for the end, threads that are still at work."""
    processes.start(plan(script(tmp_path, line)))
    assert wait_until(processes.ended, 20.0) == [("a_node", code)]
    assert processes.ended() == [], "an end is told once"
    assert said in "\n".join(processes.last_lines("a_node", 100))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_reaches_a_forked_program_as_soon_as_it_is_started(
    processes: Processes, tmp_path: Path, number: signal.Signals
) -> None:
    """It leads a group of its own by then, and ignores nothing that its parent ignores."""
    processes.start(plan(script(tmp_path, "import time", "time.sleep(1000)")))
    processes.signal(["a_node"], number)
    ((_, code),) = wait_until(processes.ended, 20.0)
    assert code in (-number, 128 + number)


def test_a_program_in_another_language_is_started_as_it_is(processes: Processes) -> None:
    """Only Python scripts for this interpreter are forked."""
    processes.start(plan("bash", "-c", "echo up"))
    assert lines_of(processes) == ["up"]


def test_which_programs_are_forked(tmp_path: Path) -> None:
    """Those whose first line names this interpreter, and nothing else."""
    assert runs_here(script(tmp_path, "pass"))
    for first in ("#!/usr/bin/env python3", "#!/bin/sh", "", f"#!{sys.executable} -E"):
        (tmp_path / "other").write_text(first + "\n")
        assert not runs_here(str(tmp_path / "other"))
    assert not runs_here(str(tmp_path / "missing"))


SPLIT = """
from scara_bringup.processes.own_line_io import make_room
make_room()
import os, sys, time
from pathlib import Path
os.environ["OF_ALL"] = "children"
from scara_bringup.processes.forked_io import WarmParent
from scara_bringup.processes.processes_io import Processes
from scara_bringup.processes.warm_parent_io import PAGES
from scara_bringup.plan import NodePlan
lock = open(sys.argv[2], "w")
logs = Path(sys.argv[2] + ".d")
with WarmParent.of_this_process(PAGES) as warm, Processes(logs, {}, warm) as nodes:
    nodes.start(NodePlan("a_node", "", sys.argv[1], ("_rate:=25",)))
    print(open(f"/proc/{warm._process.pid}/cmdline").read().rstrip(chr(0)), flush=True)
    while not (ended := nodes.ended()):
        time.sleep(0.01)
    print(ended, sys.argv[1:], flush=True)
"""


def test_the_parent_of_all_can_be_a_fork_of_the_bring_up(tmp_path: Path) -> None:
    """It shows itself and its nodes by their own names, and keeps none of the bring-up's files."""
    program = script(
        tmp_path,
        "import os, sys",
        # The parent closes its copy of this node's log some time after the fork.
        "files = [os.path.realpath(f'/proc/{os.getppid()}/fd/{n}')",
        "         for n in os.listdir(f'/proc/{os.getppid()}/fd')]",
        "words = open('/proc/self/cmdline').read().rstrip(chr(0)).split(chr(0))",
        "print(words == [sys.executable, *sys.argv], os.environ['OF_ALL'], 'rospy' in sys.modules,",
        "      'nicegui' in sys.modules,",
        f"      os.getsid(os.getppid()) == os.getppid(), {str(tmp_path / 'a_lock')!r} in files)",
    )
    bringup = tmp_path / "bringup.py"
    bringup.write_text(SPLIT)
    words = [sys.executable, str(bringup), program, str(tmp_path / "a_lock")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60.0, check=True)
    shown, ended = done.stdout.splitlines()
    assert shown.split("\0") == [sys.executable, "-m", "scara_bringup.processes.warm_parent_io"]
    assert ended == f"{[('a_node', 0)]} {words[2:]}"
    said = (tmp_path / "a_lock.d" / "a_node.log").read_text().split()
    assert said == ["True", "children", "True", "True", "True", "False"]


def test_all_die_with_a_bring_up_that_is_killed(tmp_path: Path) -> None:
    """Not even SIGKILL of the bring-up leaves parent or node behind."""
    program = script(tmp_path, "import time", "time.sleep(1000)")
    bringup = (
        "import os, time\nfrom pathlib import Path\n"
        "from scara_bringup.processes.forked_io import WarmParent\n"
        "from scara_bringup.processes.processes_io import Processes\n"
        "from scara_bringup.plan import NodePlan\n"
        "warm = WarmParent(os.environ)\n"
        f"p = Processes(Path({str(tmp_path)!r}), os.environ, warm)\n"
        f"print(p.start(NodePlan('child', '', {program!r})), warm._process.pid, flush=True)\n"
        "time.sleep(1000)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", bringup], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pids = parent.stdout.readline().split()
        assert len(pids) == 2
        parent.kill()
    wait_until(lambda: not any(map(is_alive, pids)), 20.0, "the end of both")


def test_a_parent_that_dies_is_an_end_of_all_its_children(tmp_path: Path) -> None:
    """The bring-up names them as killed, and starts no other."""
    with WarmParent(os.environ) as warm, Processes(tmp_path / "log", os.environ, warm) as processes:
        program = script(tmp_path, "import time", "time.sleep(1000)")
        processes.start(plan(program))
        warm._process.kill()
        assert wait_until(processes.ended, 20.0) == [("a_node", -9)]
        with pytest.raises(WarmParentError, match=f"{program}: not started: .* with code -9"):
            processes.start(plan(program))
