"""Memory of a node: what stays for good, and what is given back."""

from __future__ import annotations

import ctypes
import gc
import mmap
import re
from collections.abc import Iterator
from pathlib import Path

_MAPPING = re.compile(r"([0-9a-f]+)-([0-9a-f]+) (\S+) \S+ \S+ \S+ *(.*)")


def keep_for_good() -> None:
    """Hide all that lives now from the garbage collector, and give back what only loading needed.

    To be called once, before a loop starts. What a node loads at its start lives as long as the
    node. Searching all of it took 20 to 100 ms in joint_pose_controller, some seconds after its
    start: the twin began to move 40 ms late.
    """
    gc.collect()
    gc.freeze()
    give_back_code()


def give_back() -> None:
    """Give the system back what C libraries have freed, and their code that was read and waits.

    To be called after something large is gone. The C library keeps it for the next one that asks,
    for ever if nobody does. Where it cannot be told (another one than glibc), it goes on so.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    give_back_code()


def give_back_code() -> None:
    """Give the system back what was read of libraries' files; to be called when a start is over.

    Loading reads most of a library's file, running it a part: the judge of motions goes from 52 to
    28 MB. What is used again is read again, from the system's own copy.
    """
    library = ctypes.CDLL(None, use_errno=True)
    library.madvise.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    for begin, end in _unwritten():
        library.madvise(begin, end - begin, mmap.MADV_DONTNEED)


def _unwritten() -> Iterator[tuple[int, int]]:
    """Yield begin and end of each piece of a file in which no page is this process's own.

    A library's tables of addresses cannot be written to either, but were when it was loaded: a page
    of them that is given back would come back as it is in the file.
    """
    begin = end = 0
    of_file = False
    for line in Path("/proc/self/smaps").read_text().splitlines():
        mapping = _MAPPING.fullmatch(line)
        if mapping is not None:
            begin, end = int(mapping[1], 16), int(mapping[2], 16)
            of_file = mapping[3] in ("r--p", "r-xp") and mapping[4].startswith("/")
        elif of_file and re.fullmatch(r"Anonymous: +0 kB", line):
            yield begin, end
