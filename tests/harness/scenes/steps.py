"""What tests of a whole cell in virtual time do again and again."""

from __future__ import annotations

from harness.scenes.truth import standstill_since, travel
from harness.virtual_cell.cell import VirtualCell

ROBOT = "fanuc_sr6ia"
AWAY = (1.2, 1.0, -0.10, 0.8)
"""A pose of the twin's joints [rad, m], far from home."""
AT_REST_DEG_MM = 5e-3
"""More than this counts as motion: half the last digit that a robot shows."""
WATCHED_S = 1.5


def go(cell: VirtualCell, speed_percent: float) -> None:
    """Let the operator move both away from home."""
    answer = cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=speed_percent)
    assert answer.success, answer.message
    cell.wait_until(lambda: cell.mode == "OPERATOR_LEADS", 5.0, "OPERATOR_LEADS")


def run_program(cell: VirtualCell, name: str = "TWO_POINT") -> None:
    """Start a program on the robot's pendant, until the robot leads."""
    cell.real.pendant(100.0, cell.files.program_number(name))
    cell.wait_until(lambda: cell.mode == "REAL_LEADS", 15.0, "REAL_LEADS")


def both_stood(cell: VirtualCell, begun: float) -> float:
    """Wait until both stand; return when the later of them stood."""
    sides = (cell.real, cell.twin)

    def stand() -> bool:
        # Of the last moments alone: this is asked each 10 ms, and the rows get many.
        since = cell.schedule.now - 0.2
        return begun < since and all(standstill_since(side.truth, since) == since for side in sides)

    cell.wait_whatever(stand, 5.0, "standstill of both")
    return max(standstill_since(side.truth, begun) for side in sides)


def nothing_moves(cell: VirtualCell, since: float, watched: float = WATCHED_S) -> None:
    """Watch for a while; neither side has moved since ``since`` [s]."""
    cell.schedule.run(watched)
    went = {name: travel(getattr(cell, name).truth, since) for name in ("real", "twin")}
    assert max(went.values()) < AT_REST_DEG_MM, went
