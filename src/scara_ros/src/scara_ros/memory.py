"""Memory of a node with a control loop."""

from __future__ import annotations

import gc


def keep_for_good() -> None:
    """Take everything that lives now out of the garbage collector's sight; called once, before a loop starts.

    What a node loads at its start lives as long as the node. Searching all of it took 43 ms in the emulator and 84 ms in the
    twin controller: the time of four and of eight set points.
    """
    gc.collect()
    gc.freeze()
