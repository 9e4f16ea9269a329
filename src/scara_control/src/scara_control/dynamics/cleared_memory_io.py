"""Memory that was only cleared, and that the system may have back."""

from __future__ import annotations

import ctypes
import mmap
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

LARGE = 16 << 20
"""What is cleared is looked for in memory that is at least so large [bytes]; our choice."""
_RUN = 16
"""At least so many pages behind each other are given back; our choice."""
# Private and without a file or a name: only there a page that was given back reads as zeros.
_ANONYMOUS = re.compile("([0-9a-f]+)-([0-9a-f]+) rw-p 0+ 00:00 0 *")


def give_back_cleared() -> int:
    """Give the system back each page of large memory that holds only zeros; return how many.

    Nothing changes for who reads them: the system gives a page of zeros when one is used again. To
    be called where no other thread may write, since a page must not change while it is looked at.
    """
    # Python's own madvise reaches only what its mmap module has mapped.
    library = ctypes.CDLL(None, use_errno=True)
    library.madvise.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
    given = 0
    for begin, end in list(_large_memory()):
        memory = (ctypes.c_char * (end - begin)).from_address(begin)
        words = np.frombuffer(memoryview(memory), np.uint64).reshape(-1, mmap.PAGESIZE // 8)
        # With a False at each end, a run that touches an end has a beginning and an end as well.
        cleared = np.concatenate(([False], ~words.any(axis=1), [False]))
        changes = np.flatnonzero(cleared[1:] != cleared[:-1]).tolist()
        for first, last in zip(changes[::2], changes[1::2]):
            pages = words[first:last]
            # The interpreter may have put its own objects there since they were found: the list of
            # them is one. What is needed from here on is made before they are looked at again.
            place, size, count = pages.ctypes.data, pages.nbytes, len(pages)
            if count >= _RUN and not pages.any():
                given += 0 if library.madvise(place, size, mmap.MADV_DONTNEED) else count
    return given


def _large_memory() -> Iterator[tuple[int, int]]:
    """Yield begin and end of each piece of memory that is this process's own and no file's."""
    for line in Path("/proc/self/maps").read_text().splitlines():
        found = _ANONYMOUS.fullmatch(line)
        if found is not None:
            begin, end = int(found[1], 16), int(found[2], 16)
            if end - begin >= LARGE:
                yield begin, end
