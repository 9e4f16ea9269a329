"""What all programs share at their edges: words, folders, one line for an error, exit codes."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TextIO

FAILED, WRONG, UNUSABLE, INTERRUPTED = 1, 2, 3, 130
"""Exit codes: the answer is no; wrong words or configuration; what it needs cannot be used; Ctrl-C.
"""

SYSTEM = "/usr"
"""Prefix of Debian's own packages."""
Codes = Mapping[type[BaseException], int]
"""Exit code of each kind of error; the first kind that fits counts."""


@contextlib.contextmanager
def ends_with(name: str, codes: Codes) -> Iterator[None]:
    """End the program ``name`` with one line where the body raises one of ``codes``.

    Raises:
        SystemExit: It did; with the exit code of that error.
    """
    try:
        yield
    except BrokenPipeError:
        raise  # nobody reads any longer what the program says
    except tuple(codes) as error:
        text = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        print(f"{name}: {text}", file=sys.stderr, flush=True)
        sys.exit(next(code for kind, code in codes.items() if isinstance(error, kind)))


def say(text: str, stream: TextIO | None = None) -> None:
    """Print a line, by default to stdout, for a thread that goes on if nobody reads it."""
    with contextlib.suppress(OSError):
        print(text, file=stream, flush=True)


def require_library(name: str, scope: str, code: int = FAILED) -> None:
    """End this program with one line if a library is not installed.

    Args:
        name: As it is imported.
        scope: Of ``./cell setup``, that installs it.
        code: Exit code then.

    Raises:
        SystemExit: It is not installed.
    """
    if importlib.util.find_spec(name) is None:
        program = Path(sys.argv[0]).name
        print(
            f"{program}: the library {name} is not installed. To install it: ./cell setup {scope}",
            file=sys.stderr,
        )
        sys.exit(code)


def private_parameters(words: Sequence[str]) -> dict[str, str]:
    """Return the parameters ``_NAME:=VALUE`` among the words of a command line.

    Example:
        >>> private_parameters(["emulator", "_port:=1502", "chatter:=talk"])
        {'port': '1502'}
    """
    parted = (word.partition(":=") for word in words)
    return {key[1:]: value for key, mark, value in parted if mark and key.startswith("_")}


def without_remappings(words: Sequence[str]) -> list[str]:
    """Return the words that are no ``NAME:=VALUE``: rosrun passes those to every program."""
    return [word for word in words if ":=" not in word]


def command_of(package: str, executable: str, env: Mapping[str, str]) -> list[str]:
    """Return the words that start a node.

    They name its file in one of catkin's prefixes, else rosrun, which also says why it finds none.

    Args:
        package: Name of the package.
        executable: Name of the node's script or program.
        env: Environment of the node; its CMAKE_PREFIX_PATH names the workspaces, the chosen one
            first.
    """
    for prefix in (*env.get("CMAKE_PREFIX_PATH", "").split(os.pathsep), SYSTEM):
        file = Path(prefix) / "lib" / package / executable
        if prefix and file.is_file() and os.access(file, os.X_OK):
            return [str(file)]
    return ["rosrun", package, executable]


def workspace() -> Path:
    """Return the root of the workspace (``CELL_ROOT``), or the working folder outside of one."""
    return Path(os.environ.get("CELL_ROOT") or Path.cwd())


def runs_folder(given: str | Path | None = None) -> Path:
    """Return the folder of the runs: ``given``, else ``runs`` of the workspace."""
    return Path(given) if given else workspace() / "runs"


def new_run_folder(base: Path, stamp: str) -> Path:
    """Create ``base/stamp``, with a number appended if it is taken, and return it."""
    base.mkdir(parents=True, exist_ok=True)
    for number in range(1, 1000):
        folder = base / (stamp if number == 1 else f"{stamp}_{number}")
        # mkdir itself tells who came first: two runs may begin within one second.
        with contextlib.suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise FileExistsError(f"{base}/{stamp}: taken a thousand times")


def link_latest(folder: Path) -> None:
    """Let ``latest`` beside ``folder`` point to it, at once.

    A real folder of that name is left alone.
    """
    link, fresh = folder.parent / "latest", folder.parent / f".latest_{os.getpid()}"
    if link.is_dir() and not link.is_symlink():
        return
    fresh.symlink_to(folder.name)
    fresh.replace(link)
