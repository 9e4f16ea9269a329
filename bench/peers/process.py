"""A peer in a process of its own.

Asked over its standard input, one JSON line for each question and each answer.
"""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
from pathlib import Path
from typing import Any

from typing_extensions import Self

from bench.peers.install import PYTHON, PeerMissing, clean_environment

ROOT = Path(__file__).resolve().parents[2]


class PeerError(RuntimeError):
    """A peer has failed or did not answer in time."""


class Peer:
    """One job in a process of its own; a context manager.

    ``ask`` makes it work while this process waits.
    """

    def __init__(
        self, job: str, python: Path = PYTHON, deadline: float = 120.0, **arguments: Any
    ) -> None:
        """Start the job ``module:Class`` of ``bench.peers`` with its arguments.

        Raises:
            PeerMissing: Its library is not installed.
            PeerError: It failed.
        """
        if not python.exists():
            raise PeerMissing(f"peer not installed: {python} is missing")
        self._deadline = deadline
        self._process = subprocess.Popen(
            [str(python), "-m", "bench.peers.worker"],
            cwd=ROOT,
            env=clean_environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            self.version: str = self._exchange({"job": job, "arguments": arguments})
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ask(self, method: str, **arguments: Any) -> Any:
        """Call a method of the job and return its answer."""
        return self._exchange({"ask": method, "arguments": arguments})

    def close(self) -> None:
        """End the process."""
        with contextlib.suppress(OSError):
            if self._process.stdin:
                self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout:
            self._process.stdout.close()

    def _exchange(self, question: dict[str, Any]) -> Any:
        assert self._process.stdin and self._process.stdout
        try:
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
        except OSError as error:
            raise PeerError(f"the peer has ended: {error}") from None
        if not select.select([self._process.stdout], [], [], self._deadline)[0]:
            raise PeerError(f"the peer did not answer within {self._deadline:g} s")
        line = self._process.stdout.readline()
        if not line:
            raise PeerError(f"the peer has ended with {self._process.poll()}")
        answer = json.loads(line)
        if "missing" in answer:
            raise PeerMissing(f"peer not installed: {answer['missing']}")
        if "error" in answer:
            raise PeerError(answer["error"])
        return answer["answer"]
