"""Which cells run, and what a process uses.

Each cell writes a file into its folder, and a link to it where all are found.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
from scara_ros.names import cell_of
from scara_ros.shell.program_io import runs_folder

from scara_bringup.status.status import Usage

FILE = "cell.json"
INDEX = ".running"
TICKS = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
BOOT = Path("/proc/sys/kernel/random/boot_id")


class RunningNode(msgspec.Struct, frozen=True):
    """One node of a running cell: process id, what starts it by hand, and its log."""

    name: str
    pid: int
    command: str
    log: str


class RunningCell(msgspec.Struct, frozen=True):
    """A running cell.

    Attributes:
        pid: Of the bring-up.
        verb: ``up`` or ``demo``.
        robot: Its name.
        plant: How its stand-in behaves; empty: it has none.
        master_uri: The ROS master.
        namespace: Of its nodes.
        folder: Of logs and results.
        addresses: Of its pages, by what they are.
        nodes: In the order in which they were started.
        runs: The folder of its recordings and its journal.
        born: When its process began (:func:`birth_of`): a later one may have its number. Empty: a
            file of before.
    """

    pid: int
    verb: str
    robot: str
    plant: str
    master_uri: str
    namespace: str
    folder: str
    addresses: dict[str, str]
    nodes: list[RunningNode]
    runs: str = ""
    born: str = ""

    @property
    def name(self) -> str:
        """What people call it."""
        return cell_of(self.namespace)


def index() -> Path:
    """Return the folder of the links."""
    return runs_folder() / INDEX


@contextmanager
def announced(cell: RunningCell) -> Iterator[None]:
    """Let a cell be found while the context lasts.

    Its file may hold tokens, so only this user can read it. A disk that takes no file costs
    ``./cell status`` only.
    """
    file, link = Path(cell.folder) / FILE, index() / f"{cell.pid}.json"
    with contextlib.suppress(OSError):
        # Made anew, so that nothing is written into a file that is somebody else's.
        file.unlink(missing_ok=True)
        with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as stream:
            stream.write(msgspec.json.format(msgspec.json.encode(cell), indent=1))
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(file)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            link.unlink(missing_ok=True)
            link.parent.rmdir()  # where no other cell runs


def running_cells() -> list[RunningCell]:
    """Return the cells of this workspace that run; links of those that were killed are removed."""
    found = []
    for link in sorted(index().glob("*.json")):
        with contextlib.suppress(OSError, msgspec.MsgspecError, UnicodeDecodeError):
            cell = msgspec.json.decode(link.read_bytes(), type=RunningCell)
            if is_bring_up(cell.pid) and cell.born in ("", birth_of(cell.pid)):
                found.append(cell)
                continue
        with contextlib.suppress(OSError):
            link.unlink()
    return found


def is_bring_up(pid: int) -> bool:
    """Return whether a process is a bring-up: its number may be another's by now."""
    with contextlib.suppress(OSError):
        words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        return any(word.rsplit(b"/", 1)[-1] == b"cell" for word in words)
    return False


def birth_of(pid: int) -> str:
    """Return in which boot of the machine and when in it a process began; empty: it is gone.

    In a container each start of a cell has the number 1; after a boot numbers come again, too.
    """
    with contextlib.suppress(OSError, IndexError):
        # Field 22 of proc(5): the start, in ticks since the boot.
        return f"{BOOT.read_text().strip()} {_stat(pid)[19]}"
    return ""


def usage_of(pid: int) -> Usage | None:
    """Return what a process has used up to now; None if it is not there or has ended."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        fields = _stat(pid)
        # What has ended stays as Z until its parent asks for its exit code.
        if fields[0] != "Z":
            # Fields 14, 15 and 24 of proc(5): user time, system time, pages in memory.
            processor = (int(fields[11]) + int(fields[12])) / TICKS
            return Usage(processor, int(fields[21]) * PAGE_BYTES / 1e6)
    return None


def _stat(pid: int) -> list[str]:
    """Return what proc(5) calls the third and all later fields of a process's ``stat``."""
    # The name of a program stands in brackets and may hold spaces.
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
