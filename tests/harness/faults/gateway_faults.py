"""Faults of the gateway's clients: floods, giants, depth, slowness, one that never reads.

The others must not feel it.
"""

from __future__ import annotations

import multiprocessing
import time
from concurrent.futures import ProcessPoolExecutor
from random import Random

from harness.faults.fault_cell import FaultCell
from harness.faults.link_faults import losses
from harness.faults.rows import Row
from harness.opponents import attacks

GROWTH_MB = {"huge": 32.0, "nested": 32.0}
"""Beside 1 MB: what a few packets of 8 MB, the hard limit, leave in the allocator."""
SHARE = 0.7
"""Of its messages an honest client gets at least this part beside a flood.

The machine has two cores for everything.
"""
SILENCE_S = 0.25
ROUNDS = 3
"""So often the attack is made where the memory grows: a leak grows each time, what the allocator
keeps for the next time does not. Floods one after the other: up to 6 MB in all, then no more.
"""


def attacked(cell: FaultCell, name: str, rng: Random, seconds: float) -> list[Row]:
    """Attack the gateway beside an honest client and the twin controller.

    Look at both, and at the gateway's memory.
    """
    attack = getattr(attacks, name)
    port = cell.gateway_port
    cell.recover()
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        pool.submit(attack, port, 1.0, rng.randrange(1 << 30)).result()
        alone, _ = pool.submit(attacks.reader, port, 2.0, 0).result()
        before, begun = cell.memory("gateway"), time.time()
        bad = pool.submit(attack, port, seconds, rng.randrange(1 << 30))
        beside, silence = pool.submit(attacks.reader, port, seconds - 0.5, 0).result()
        done = bad.result()
        limit, grown = GROWTH_MB.get(name, 1.0), [_grown(cell, before)]
        while grown[-1] > limit and len(grown) < ROUNDS:
            before = cell.memory("gateway")
            done += pool.submit(attack, port, seconds, rng.randrange(1 << 30)).result()
            grown.append(_grown(cell, before))
    fault = f"gateway: {name.replace('_', ' ')}"
    return [
        Row(fault, "attacks made", 1.0, float(done), at_least=True),
        Row(fault, "gateway's memory grows each time [MB]", limit, grown[-1]),
        Row(
            fault,
            "messages of an honest client [part of those before]",
            SHARE,
            beside / (seconds - 0.5) / (alone / 2.0),
            True,
        ),
        Row(fault, "longest silence of an honest client [s]", SILENCE_S, silence),
        losses(cell, fault, begun),
    ]


def _grown(cell: FaultCell, before: float) -> float:
    """Return by how much the gateway's memory has grown [MB], once the attack is over."""
    time.sleep(1.5)  # what is half open is given up by now
    return cell.memory("gateway") - before
