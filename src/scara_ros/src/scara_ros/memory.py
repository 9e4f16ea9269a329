"""Memory of a node: what stays for good, and what is given back."""

from __future__ import annotations

import ctypes
import gc


def keep_for_good() -> None:
    """Hide all that lives now from the garbage collector; call once, before a loop starts.

    What a node loads at its start lives as long as the node. Searching all of it took 20 to 100 ms
    in joint_pose_controller, some seconds after its start: the twin began to move 40 ms late.
    """
    gc.collect()
    gc.freeze()


def give_back() -> None:
    """Give the system back what C libraries have freed; to be called after something large is gone.

    The C library keeps it for the next one that asks, for ever if nobody does. Where it cannot be
    told (another one than glibc), it goes on so.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
