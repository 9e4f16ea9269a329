"""Children of a warm parent, handled like those of this process."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from typing_extensions import Self

from scara_bringup.processes import warm_parent_io as warm_parent
from scara_bringup.processes.own_line_io import ROOM

FORK_S = 20.0  # our choice: loading takes half a second on an idle machine
GONE = -9  # what dies with its parent


class WarmParentError(RuntimeError):
    """The process that forks the nodes cannot; the text says why."""


class WarmParent:
    """A process that has loaded what all nodes load, and forks them.

    As a context manager it ends the process, and with it all that it has forked.
    """

    def __init__(self, env: Mapping[str, str], besides: Sequence[str] = ()) -> None:
        """Begin to load in a program of its own; ``env`` is the environment of all children.

        ``besides`` are modules that some of them share.
        """
        # Each request and each answer is a packet of its own: none has to be put together.
        self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        number = theirs.fileno()
        module = [sys.executable, "-m", "scara_bringup.processes.warm_parent_io"]
        with theirs:
            self._process: subprocess.Popen[bytes] | _Fork = subprocess.Popen(
                [
                    "setpriv",
                    "--pdeathsig",
                    "KILL",
                    "--",
                    *module,
                    str(number),
                    *besides,
                    " " * ROOM,
                ],
                env=env,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
                pass_fds=(number,),
            )
        self._codes: dict[int, int] = {}
        self._lost = False

    @classmethod
    def of_this_process(cls, besides: Sequence[str] = ()) -> Self:
        """Load in this process, modules besides too, and fork the parent of all others from it.

        So all of them have what is loaded in common with this process, the files that it has read
        included. Its environment is theirs. To be called without another thread, and where
        :func:`~scara_bringup.processes.own_line_io.make_room` was called when the process began.
        """
        warm_parent.load(besides)
        parent = cls.__new__(cls)
        parent._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            parent._process = _Fork(warm_parent.split_off(theirs))
        parent._codes, parent._lost = {}, False
        return parent

    def fork(self, words: Sequence[str], stdout: int, stderr: int) -> ForkedChild:
        """Start the Python program ``words`` with these files as its output.

        Raises:
            WarmParentError: The parent has died, or takes longer than ``FORK_S``.
        """
        with contextlib.suppress(ConnectionError):  # what has died is noticed below
            socket.send_fds(self._line, [json.dumps(list(words)).encode()], [stdout, stderr])
        until = time.monotonic() + FORK_S
        while told := self._receive(until - time.monotonic()):
            if "begun" in told:
                return ForkedChild(self, told["begun"])
        why = f"does not answer within {FORK_S:g} s"
        if self._lost:
            why = f"has ended with code {self._process.wait()}"
        raise WarmParentError(f"{words[0]}: not started: the process that forks the nodes {why}")

    def code(self, pid: int, wait: float = 0.0) -> int | None:
        """Return the exit code of a child once it has ended, after ``wait`` [s] at most."""
        until = time.monotonic() + wait
        while pid not in self._codes:
            if self._lost:
                return GONE
            if not self._receive(until - time.monotonic()):
                break
        return self._codes.get(pid, GONE if self._lost else None)

    def _receive(self, wait: float) -> dict[str, Any]:
        """Return the next message within ``wait`` [s], empty if there is none."""
        poll = select.poll()
        poll.register(self._line, select.POLLIN)
        if self._lost or not poll.poll(max(0.0, wait) * 1e3):
            return {}
        data = b""
        with contextlib.suppress(ConnectionError):
            data = self._line.recv(warm_parent.MESSAGE)
        if not data:
            self._lost = True
            return {}
        told: dict[str, Any] = json.loads(data)
        if "ended" in told:
            self._codes[told["ended"]] = told["code"]
        return told

    def __enter__(self) -> WarmParent:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process; what it has forked ends with it."""
        self._line.close()
        self._lost = True
        self._process.kill()
        self._process.wait()


class _Fork:
    """A fork of this process, with what is used of ``subprocess.Popen``."""

    def __init__(self, pid: int) -> None:
        """Remember its id."""
        self.pid = pid
        self._code: int | None = None

    def kill(self) -> None:
        """Kill it, unless it has been waited for."""
        if self._code is None:
            os.kill(self.pid, signal.SIGKILL)

    def wait(self) -> int:
        """Wait for its end and return its exit code."""
        if self._code is None:
            self._code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self._code


class ForkedChild:
    """A child of a warm parent, with what is used of ``subprocess.Popen``."""

    def __init__(self, parent: WarmParent, pid: int) -> None:
        """Remember both."""
        self._parent, self.pid = parent, pid

    def poll(self) -> int | None:
        """Return the exit code once it has ended, negative for a signal."""
        return self._parent.code(self.pid)

    def wait(self, timeout: float) -> int:
        """Wait for the end.

        Raises:
            subprocess.TimeoutExpired: It lives on.
        """
        code = self._parent.code(self.pid, timeout)
        if code is None:
            raise subprocess.TimeoutExpired(str(self.pid), timeout)
        return code


def runs_here(program: str) -> bool:
    """Return whether a program is a script for the interpreter that runs this."""
    try:
        with Path(program).open("rb") as file:
            first = file.readline(4096)
    except OSError:
        return False
    words = first[2:].split()
    # More words, as behind env, may lead to another Python.
    if not first.startswith(b"#!") or len(words) != 1:
        return False
    return os.path.abspath(os.fsdecode(words[0])) == os.path.abspath(sys.executable)
