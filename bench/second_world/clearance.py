"""Clearance beside an outside library, MuJoCo, on the same URDF."""

from __future__ import annotations

from pathlib import Path

from harness.second_world.oracle import compare
from harness.starter import chosen
from rich.console import Console
from what_if.cell_files_io import read_cell

from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "articulated_six")


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Compare in ``count`` poses of each robot."""
    found = []
    for robot in ROBOTS:
        with chosen(robot):
            compared = compare(read_cell(CONFIG), count)
        apart = 1e3 * max(compared.apart, compared.deeper)
        note = f"largest difference, {count} poses, {compared.free} of them free"
        found.append(Figure(f"clearance, {robot}", "mm", 0.5, apart, note=note))
        console.print(f"{robot}: {apart:.4f} mm")
    return found
