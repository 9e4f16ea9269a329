"""Exercise 5: which side moved first, on two clocks, with noise, and with ties.

Times of the readings are whole ms. Of each motion is drawn with which reading each side begins.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scara_config import Robot
from scara_course.marking import Table

REAL_MS, TWIN_MS = 8, 5
"""Periods of the readings."""
READINGS = {"real": 30, "twin": 48}
CLOCK, SPIKE = "clock", "spike"
# Wanted difference, real less twin, on one clock [ms]; the readings' grid moves it by 4 at most.
# One is turned round by the clocks, one is a tie, one has a reading that is off alone.
KINDS = {"plain": -70, "turned": 26, "tie": 5, SPIKE: -45}
Row = dict[str, float | str]


def draw(generator: np.random.Generator) -> Table:
    """Draw the clocks and four motions, in any order."""
    offset = -int(generator.integers(45, 61))
    given: Table = {CLOCK: {"offset_ms": offset, "uncertainty_ms": 10}}
    for number, kind in enumerate(generator.permutation(list(KINDS)), 1):
        twin_first, phase = int(generator.integers(26, 34)), int(generator.integers(0, REAL_MS))
        at = TWIN_MS * twin_first + KINDS[str(kind)] - phase
        given[f"m{number}"] = {
            "kind": str(kind),
            "rest_deg": int(generator.integers(-60, 61)),
            "phase_ms": phase,
            "real_first": round(at / REAL_MS),
            "twin_first": twin_first,
        }
    return given


def material(given: Table, robot: Robot) -> dict[str, str]:
    """Return the table of readings, and what is known of the clocks."""
    del robot
    lines = ["motion,side,time_ms,joint_1_deg"]
    for name, row in _motions(given):
        for side, count in READINGS.items():
            for k in range(count):
                lines.append(f"{name},{side},{_time(given, row, side, k)},{reading(row, side, k)}")
    clock = (
        f"offset_ms: {given[CLOCK]['offset_ms']}   # the real robot's clock less the twin's\n"
        f"uncertainty_ms: {given[CLOCK]['uncertainty_ms']}\n"
    )
    return {"readings.csv": "\n".join(lines) + "\n", "clocks.yaml": clock}


def _motions(given: Table) -> list[tuple[str, Row]]:
    return [(name, row) for name, row in given.items() if name != CLOCK]


def _time(given: Table, row: Row, side: str, k: int) -> int:
    """Return what the side's own clock shows at reading k [ms]."""
    if side == "twin":
        return 1000 + TWIN_MS * k
    return 1000 + REAL_MS * k + int(row["phase_ms"]) + int(given[CLOCK]["offset_ms"])


def reading(row: Row, side: str, k: int) -> str:
    """Return reading k [deg]: at rest it flickers by 0.01, then the joint goes."""
    first = int(row[f"{side}_first"])
    # The first reading of a motion stands clear of the flicker, so each side has one onset only.
    off = (k * 7 % 3 - 1) / 100.0 if k < first else 0.05 + 0.06 * (k - first)
    if row["kind"] == SPIKE and side == "twin" and k == 4:
        off = 0.07
    return f"{float(row['rest_deg']) + off:.2f}"


def solve(given: Table, robot: Robot) -> Table:
    """Return of each motion the difference of the onsets, whether it is a tie, and who leads."""
    del robot
    return _judged(given)


def _judged(
    given: Table,
    difference: Callable[[float, float], float] = lambda raw, offset: raw - offset,
    ties: bool = True,
    spikes: bool = False,
    shown: Callable[[float], float] = lambda ms: ms,
) -> Table:
    """Judge all motions, or what comes of a mistake."""
    found: Table = {}
    for name, row in _motions(given):
        # Reading 4 is the one that is off alone.
        twin_first = 4 if spikes and row["kind"] == SPIKE else int(row["twin_first"])
        raw = _time(given, row, "real", int(row["real_first"])) - _time(
            given, row, "twin", twin_first
        )
        apart = difference(raw, float(given[CLOCK]["offset_ms"]))
        tie = ties and abs(apart) < float(given[CLOCK]["uncertainty_ms"])
        found[name] = {
            "difference_ms": shown(apart),
            "tie": "yes" if tie else "no",
            "leader": "real" if tie or apart < 0.0 else "twin",
        }
    return found


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give."""
    del robot
    return {
        "both clocks must be made one first": _judged(given, lambda raw, offset: raw),
        "take the offset off the real robot's time: its sign": _judged(
            given, lambda raw, offset: raw + offset
        ),
        "closer than the uncertainty is a tie, and the real robot leads": _judged(
            given, ties=False
        ),
        "one reading alone is noise: three in a row count": _judged(given, spikes=True),
        "the difference is the real robot's onset less the twin's: its sign": _judged(
            given, shown=lambda ms: -ms
        ),
        "asked for is ms, not s": _judged(given, shown=lambda ms: ms / 1e3),
    }
