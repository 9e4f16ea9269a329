"""Random programs, half with a planted harm: how many are missed, how many free ones refused."""

from __future__ import annotations

from pathlib import Path

from harness.second_world.campaign import Counted, benches, run
from rich.console import Console

from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
SEED, TOLD_EVERY = 29, 100


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Judge ``count`` random programs."""

    def told(done: int, counted: Counted) -> None:
        if done % TOLD_EVERY == 0:
            missed = sum(counted.missed.values())
            console.print(f"{done} programs: {missed} missed, {counted.refused} refused wrongly")

    with benches(CONFIG, SEED) as known:
        found = run(count, known, told)
    (folder / "what_if_wrong.txt").write_text("\n".join(found.wrong) + "\n", encoding="utf-8")
    planted = [
        Figure(f"planted: {name}", "", 0.0, found.missed[name], note=f"missed of {n}", always=True)
        for name, n in found.planted.items()
    ]
    share = 100.0 * found.refused / found.free
    return [*planted, Figure("free programs", "%", 1.0, share, note=f"refused of {found.free}")]
