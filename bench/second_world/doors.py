"""Refused commands to a whole cell, by all its doors: set points on both wires all the same."""

from __future__ import annotations

from pathlib import Path

from harness.second_world.refusing_cell import RefusingCell, refused_requests
from rich.console import Console

from bench.second_world.figure import Figure

LOT = 100


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Ask for ``count`` refused motions, then for a free one, which both counters must see."""
    requests, wrong = refused_requests(count), list[str]()
    with RefusingCell(folder / "doors") as cell:
        for begin in range(0, count, LOT):
            wrong += cell.refuse(requests[begin : begin + LOT])
            done = min(begin + LOT, count)
            console.print(f"{done} refused commands: {cell.setpoints} and {cell.writes} set points")
        found = (cell.setpoints, cell.writes)
        cell.move()
        seen = (cell.setpoints - found[0], cell.writes - found[1])
    (folder / "what_if_doors.txt").write_text("\n".join(wrong) + "\n", encoding="utf-8")
    text = f"{count} by four doors over the gateway, {len(wrong)} not refused; a free move: "
    return [
        Figure(f"refused, set points {where}", "", 0.0, n, note=f"{text}{control}", always=True)
        for where, n, control in zip(("to the twin's joints", "into the robot"), found, seen)
    ]
