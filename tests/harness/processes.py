"""Start programs in their own sessions, end them, and prove that nothing is left.

Their output is kept in files.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import functools
import itertools
import os
import signal
import socket
import subprocess
import tempfile
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from typing_extensions import Self

from harness.running.repeats import Notes

if TYPE_CHECKING:
    from scara_bringup.processes.forked_io import ForkedChild

T = TypeVar("T")

LOWEST_PORT = 20_000
PORTS_OF_ONE = 800
"""How many ports one process of tests has for itself: a given one comes again after so many."""
MARK = "CELL_TEST_MARK"
ROSRUN = "/usr/bin/rosrun"
DEAF = Notes()
"""What SIGINT has not ended, and no test had stalled: the end of a run names it.

It fails nobody: a node whose master stands still, or on a late machine, may rightly be so slow."""
_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None, use_errno=True)


@functools.cache
def _own_ports(process: int) -> Iterator[int]:
    """Return the ports of a process, again and again: those of a part that it alone has.

    A lock, held as long as the process lives, keeps other processes of tests out of the part.
    """
    end = int(Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    folder = Path(tempfile.gettempdir()) / f"cell_test_ports_{os.getuid()}"
    folder.mkdir(exist_ok=True)
    for first in range(LOWEST_PORT, end - PORTS_OF_ONE, PORTS_OF_ONE):
        lock = os.open(folder / str(first), os.O_RDWR | os.O_CREAT, 0o600)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
        else:
            return itertools.cycle(range(first, first + PORTS_OF_ONE))
    raise AssertionError(f"{folder}: other processes hold each part of the ports")


def free_port() -> int:
    """Return a TCP port on 127.0.0.1 that nobody listens on, and that nobody is given by chance.

    The kernel gives the ports of its own range to outgoing connections and to servers that ask for
    any. One of those may be gone before the node that shall have it has started. So may one that
    two processes of tests choose at the same time.
    """
    for port in itertools.islice(_own_ports(os.getpid()), PORTS_OF_ONE):
        with socket.socket() as listener, contextlib.suppress(OSError):
            listener.bind(("127.0.0.1", port))
            return port
    raise AssertionError(f"all {PORTS_OF_ONE} ports of this process are listened on")


def wait_until(
    predicate: Callable[[], T],
    timeout: float = 10.0,
    what: str | Callable[[], str] = "",
    period: float = 0.02,
) -> T:
    """Ask ``predicate`` again and again.

    Return its first true answer, or fail with ``what`` after ``timeout`` [s], as it is said then.
    """
    deadline = time.monotonic() + timeout
    while True:
        answer = predicate()
        if answer:
            return answer
        if time.monotonic() > deadline:
            text = (what() if callable(what) else what) or predicate
            raise AssertionError(
                f"waited {timeout:g} s in vain for {text}; last answer: {answer!r}"
            )
        time.sleep(period)


def is_alive(pid: int | str) -> bool:
    """Say whether a process runs (a zombie does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


class Process:
    """One started program; its output is a file, its process group is ended as a whole."""

    def __init__(
        self,
        command: Iterable[str],
        env: Mapping[str, str],
        log: Path,
        cwd: Path | None = None,
        forks: bool = False,
    ) -> None:
        """Start ``command`` in a session of its own.

        It dies with the test process even if that is killed.

        Args:
            command: Its words.
            env: Its whole environment.
            log: What it prints.
            cwd: Its working directory.
            forks: Where it can be, it is a fork; see :mod:`harness.forks`.
        """
        self.command = [str(word) for word in command]
        self.log = log
        self.stalled = False
        self.popen: subprocess.Popen[bytes] | ForkedChild
        if forks:
            from harness.forks import forked  # what it imports is built

            if node := forked(self.command, env, log):
                self.popen = node
                return
        with log.open("wb") as stream:
            self.popen = subprocess.Popen(
                self.command,
                env=dict(env),
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                cwd=cwd,
                start_new_session=True,
                preexec_fn=_begin_child,
            )

    @property
    def pid(self) -> int:
        """Process id, which is the id of the process group as well."""
        return self.popen.pid

    @property
    def output(self) -> str:
        """Everything it has printed so far, both streams; empty where its log is gone."""
        return self.log.read_text(errors="replace") if self.log.exists() else ""

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self.popen.poll()

    def wait(self, timeout: float = 10.0) -> int:
        """Wait for its end and return the exit code, or fail with its last lines."""
        try:
            return self.popen.wait(timeout)
        except subprocess.TimeoutExpired:
            raise AssertionError(
                f"{self} has not ended after {timeout:g} s:\n{self.tail()}"
            ) from None

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to its whole process group."""
        if number in (signal.SIGSTOP, signal.SIGCONT):
            self.stalled = number == signal.SIGSTOP
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, number)

    def stop(self, grace: float = 8.0) -> int:
        """End it: SIGINT, after ``grace`` [s] SIGTERM, then SIGKILL; return the exit code.

        One that needs more than SIGINT is noted in :data:`DEAF`.
        """
        for number, patience in (
            (signal.SIGINT, grace),
            (signal.SIGTERM, 2.0),
            (signal.SIGKILL, 5.0),
        ):
            if self.poll() is not None:
                break
            if number is signal.SIGTERM and not self.stalled:
                DEAF.add(f"{self}: SIGINT has not ended it within {grace:g} s")
            self.signal(number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.popen.wait(patience)
        self.signal(signal.SIGKILL)
        return self.popen.wait(5.0)

    def __enter__(self) -> Self:
        """Give the process for the length of a block."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it with the block."""
        self.stop()

    def tail(self, lines: int = 60) -> str:
        """Return the last lines of its output."""
        return "\n".join(self.output.splitlines()[-lines:])

    def __str__(self) -> str:
        """Return the command line."""
        return " ".join(self.command)


class Stage:
    """All processes of one test.

    ``run`` starts, ``close`` ends them in reverse order and fails if something is left.

    Every process inherits a mark in its environment, so that grandchildren in other process groups
    are found too.
    """

    def __init__(self, folder: Path, env: Mapping[str, str]) -> None:
        """Keep logs in ``folder``; ``env`` is the environment of everything started here."""
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.mark = uuid.uuid4().hex
        self.env: dict[str, str] = {**env, MARK: self.mark}
        self.processes: list[Process] = []

    def start(
        self,
        *command: str,
        name: str = "",
        env: Mapping[str, str] | None = None,
        cwd: Path | None = None,
    ) -> Process:
        """Start a command with its output in ``<folder>/<nn>_<name>.log``."""
        name = name or Path(command[0]).name
        log = self.folder / f"{len(self.processes):02d}_{name}.log"
        environment = {**self.env, **(env or {})}
        forks = command[0] == "rosrun" and cwd is None
        words = without_rosrun(command, environment)
        process = Process(words, environment, log, cwd, forks)
        self.processes.append(process)
        return process

    def tool(
        self, *command: str, timeout: float = 20.0, env: Mapping[str, str] | None = None
    ) -> str:
        """Run a command line tool to its end and return what it printed; fail if it fails."""
        process = self.start(*command, env=env)
        code = process.wait(timeout)
        assert code == 0, f"{process} ended with {code}:\n{process.tail()}"
        return process.output

    def left_over(self) -> list[str]:
        """Return ``pid command`` of every living process that descends from this stage."""
        return [f"{pid} {command}" for pid, command in _marked(self.mark)]

    def close(self, grace: float = 8.0) -> None:
        """End everything; what had to be killed as a left-over makes the test fail."""
        for process in reversed(self.processes):
            process.stop(grace)
        with contextlib.suppress(AssertionError):
            wait_until(lambda: not self.left_over(), 3.0)
        left = _marked(self.mark)
        for pid, _ in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        with contextlib.suppress(AssertionError):
            wait_until(lambda: not self.left_over(), 5.0)
        assert not left, f"processes left behind: {left}"

    def report(self) -> str:
        """Return the last lines of the processes that tell why a test failed.

        These are the ones that run, have failed, or were started last.
        """
        telling = [p for p in self.processes if p.poll() != 0 or p in self.processes[-3:]]
        parts = [f"--- {p} (exit code {p.poll()})\n{p.tail()}" for p in telling]
        return "\n".join(parts)


def without_rosrun(command: Sequence[str], env: Mapping[str, str]) -> list[str]:
    """Return the command with ``rosrun PACKAGE NODE`` replaced by the node's file.

    rosrun takes 0.4 s of processor time to find it, for each of some hundred nodes of a run. The
    bring-up looks it up in the same way. Who wants rosrun itself gives its path, ``ROSRUN``.
    """
    from scara_ros.shell.program_io import command_of

    words = [str(word) for word in command]
    if "rosrun" not in words[:-2]:
        return words
    k = words.index("rosrun")
    return [*words[:k], *command_of(words[k + 1], words[k + 2], env), *words[k + 3 :]]


def _begin_child() -> None:
    """Let the kernel end this child when the test process is gone, however it ended.

    Let SIGINT reach it. A shell starts what runs in the background with SIGINT ignored, children
    inherit that, and a ROS master would be waited for until SIGTERM.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _marked(mark: str) -> list[tuple[int, str]]:
    """Return (pid, command) of all living processes whose environment holds ``mark``."""
    found = []
    wanted = f"{MARK}={mark}".encode()
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        with contextlib.suppress(OSError):
            if wanted in (entry / "environ").read_bytes().split(b"\0"):
                command = (
                    (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                )
                if command:
                    found.append((int(entry.name), command.strip()))
    return found
