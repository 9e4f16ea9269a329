"""Who can reach a living cell: nobody but this machine."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.live_cell import NODES, LiveCell
from scara_bringup.processes.ports_io import listeners, sockets

pytestmark = pytest.mark.system


def descendants(pid: int) -> set[int]:
    """Return a process and all that it has started, directly or not."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # ended meanwhile
                continue
            parents[int(entry.name)] = int(fields[1])
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def test_every_process_of_a_cell_listens_at_loopback_only(live_cell: LiveCell) -> None:
    """The kernel's table of sockets, beside what each process holds open."""
    family = descendants(live_cell.bringup.pid)
    by_inode = {listener.inode: listener for listener in listeners()}
    seen = [
        (command, by_inode[inode])
        for pid, command, held in sockets()
        if pid in family
        for inode in held & set(by_inode)
    ]
    assert [(command, at.address) for command, at in seen if not at.is_loopback] == []
    # Each node has at least its XML-RPC server: none was missed.
    commands = " ".join(command for command, _ in seen)
    assert [name for name in (*NODES, "rosout", "master") if name not in commands] == []
