"""Memory that is given back is read as it was."""

from __future__ import annotations

import mmap
import subprocess
import sys

from scara_control.dynamics.cleared_memory_io import LARGE

PROGRAM = """
import ctypes, mmap, sys
from pathlib import Path
from scara_control.dynamics.cleared_memory_io import give_back_cleared
from scara_ros.process.memory_io import give_back

def private():
    lines = Path("/proc/self/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_Dirty")) << 10

size = int(sys.argv[1])
block = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
block[:] = bytes(size)
for place in range(0, size, 100 * mmap.PAGESIZE):
    block[place + 7] = 1 + place % 251
before, expected = private(), bytes(block)
pages = give_back_cleared()
after = private()
assert bytes(block) == expected
block[5 * mmap.PAGESIZE] = 77
assert block[5 * mmap.PAGESIZE] == 77
give_back()
print(pages, before - after)
"""


def test_cleared_pages_are_given_back_and_all_others_stay() -> None:
    """One page of a hundred holds something."""
    size = 2 * LARGE
    words = [sys.executable, "-c", PROGRAM, str(size)]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    pages, given = map(int, said.split())
    assert pages >= 0.98 * size / mmap.PAGESIZE
    assert given > 0.9 * size
