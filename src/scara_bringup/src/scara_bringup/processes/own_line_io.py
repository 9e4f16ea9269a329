"""Room in a process's own command line, in which the nodes that are forked from it show theirs."""

from __future__ import annotations

import os
import sys
from pathlib import Path

ROOM = 1000  # our choice: longest command line that a forked node can show


def make_room() -> None:
    """Begin this program again with room in its command line, where forked nodes show theirs.

    To be called before anything is loaded.
    """
    room = " " * ROOM
    if sys.argv[-1] == room:
        sys.argv.pop()
        # The name in ps, which is the interpreter's now.
        Path("/proc/self/comm").write_text(Path(sys.argv[0]).name[:15], encoding="utf-8")
        return
    os.execv(sys.executable, [*sys.orig_argv, room])
