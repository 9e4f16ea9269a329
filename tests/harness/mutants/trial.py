"""Try one mutant: a child process imports it in place of the module and runs the tests.

No file is changed. The parent has imported the libraries but nothing of the project, and each child
is forked from it, so a trial costs the tests and not the start of an interpreter.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib.machinery
import importlib.util
import os
import signal
import sys
import time
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from types import CodeType

POLL_S = 0.05
PR_SET_PDEATHSIG = 1


class Verdict(Enum):
    """What became of a mutant; all but SURVIVED are kills."""

    SURVIVED = "survived"
    KILLED = "killed"
    TIMED_OUT = "timed out"


class _Loader(importlib.machinery.SourceFileLoader):
    """Loads a module from a text."""

    def __init__(self, name: str, path: str, text: str) -> None:
        super().__init__(name, path)
        self._text = text

    def get_code(self, fullname: str) -> CodeType:
        """Compile the text; the cache of compiled files is neither read nor written."""
        return compile(self._text, self.path, "exec", dont_inherit=True)


class _Finder:
    """Gives the mutated module to whoever imports it, and counts that."""

    def __init__(self, path: Path, text: str) -> None:
        self._path, self._text = path.resolve(), text

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Answer for the one module alone."""
        if name.rpartition(".")[2] != self._path.stem:
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        if spec is None or spec.origin is None or Path(spec.origin).resolve() != self._path:
            return None
        loader = _Loader(name, spec.origin, self._text)
        return importlib.util.spec_from_loader(name, loader, origin=spec.origin)


def preload() -> None:
    """Import what every trial needs and what is not of the project."""
    import hypothesis.strategies
    import msgspec
    import numpy
    import pytest
    import ruamel.yaml
    import ruckig
    import scipy.optimize

    assert all((hypothesis, msgspec, numpy, pytest, ruamel, ruckig, scipy))


class Trial:
    """Tests that run in a child process."""

    def __init__(
        self,
        root: Path,
        path: Path | None,
        text: str,
        tests: Sequence[str],
        limit: float,
        log: Path,
    ) -> None:
        """Start it.

        Args:
            root: Of the workspace.
            path: The module that is replaced; None: none, to see how long the tests take.
            text: What replaces it.
            tests: Files and folders, the likeliest to notice first; those that each run of
                `./cell test` has, for it is these that are judged.
            limit: Longest time [s].
            log: Gets what the tests print.
        """
        self._begun, self._limit, self.log = time.monotonic(), limit, log
        self._child = os.fork()
        if self._child == 0:
            _child(root, path, text, tests, log)

    @property
    def seconds(self) -> float:
        """How long it has run [s]."""
        return time.monotonic() - self._begun

    def poll(self) -> Verdict | None:
        """Return the verdict, None while the tests run; ends them when their time is over."""
        ended, status = os.waitpid(self._child, os.WNOHANG)
        if ended:
            return Verdict.KILLED if os.waitstatus_to_exitcode(status) else Verdict.SURVIVED
        if self.seconds < self._limit:
            return None
        self.end()
        return Verdict.TIMED_OUT

    def wait(self) -> Verdict:
        """Wait for the verdict."""
        while (verdict := self.poll()) is None:
            time.sleep(POLL_S)
        return verdict

    def end(self) -> None:
        """End the child and what it has started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._child, signal.SIGKILL)
        os.waitpid(self._child, 0)


def _child(root: Path, path: Path | None, text: str, tests: Sequence[str], log: Path) -> None:
    """Become a process group of its own, run pytest, and end without the parent's clean-up."""
    code = 3
    try:
        os.setpgid(0, 0)
        # A mutant may loop for ever: it ends with the parent, however that ends.
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        os.chdir(root)
        sink = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(sink, 1)
        os.dup2(sink, 2)
        if path is not None:
            sys.meta_path.insert(0, _Finder(path, text))
        import pytest

        options = ["-x", "-q", "--no-header", "-p", "no:cacheprovider", "--tb=line"]
        options += ["-m", "not thorough"]
        code = int(pytest.main([*options, *tests]))
    except BaseException as error:
        print(repr(error), flush=True)
    finally:
        os._exit(code)
