"""How long a call takes; used on both sides, so it needs nothing but the standard library."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable


def timed(call: Callable[[], object], times: int) -> list[float]:
    """Call again and again and return how long each call took [s]."""
    clock, samples = time.perf_counter, []
    for _ in range(times):
        begun = clock()
        call()
        samples.append(clock() - begun)
    return samples


def timed_blocks(blocks: int, block: Callable[[], int]) -> list[float]:
    """Time whole blocks and return the seconds of one call in each.

    For calls that a clock reading would disturb.

    Args:
        blocks: How many.
        block: Makes some calls and returns how many.
    """
    samples = []
    gc.collect()
    gc.disable()
    try:
        for _ in range(blocks):
            begun = time.perf_counter()
            count = block()
            samples.append((time.perf_counter() - begun) / count)
    finally:
        gc.enable()
    return samples
