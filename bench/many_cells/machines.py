"""Three machines with certificates, in network namespaces behind slow lines."""

from __future__ import annotations

from pathlib import Path

from harness.machines.cut_farm import CELLS, SLOW, cut_for
from harness.machines.namespaces import missing
from rich.console import Console

from bench.second_world.figure import Figure

CUT_S = 60.0


def measure(share: float, folder: Path, console: Console) -> list[Figure]:
    """Cut the line of one of two machines for a minute.

    Raises:
        RuntimeError: This machine has no network namespaces; the text says why.
    """
    if why := missing():
        raise RuntimeError(f"network namespaces: {why}")
    cut = max(5.0, CUT_S * share)
    seen = cut_for(cut, folder / "machines", console.print)
    line = f"{SLOW.delay_ms:g} ms and {SLOW.loss_percent:g} % loss both ways"
    note = f"of {seen.expected}, {2 * CELLS} cells on two machines, {line}, cut for {cut:g} s"
    unanswered = 2 * CELLS - seen.stopped
    return [
        Figure("three machines: events missing", "", 0.0, seen.missing, note=note, always=True),
        Figure("three machines: events doubled", "", 0.0, seen.doubled, note=note, always=True),
        Figure("three machines: cells that STOP did not reach after the cut", "", 0.0, unanswered),
        Figure("three machines: the cut is seen after", "s", 3.0, seen.lost_s),
        Figure("three machines: seen again after", "s", 5.0, seen.back_s),
    ]
