"""Exercise 8: what the robot's registers said, word by word, and what went wrong on the way."""

from __future__ import annotations

import struct

import numpy as np
from scara_config import Robot
from scara_course.marking import Table

WIRE, DECODED, FAULT = "wire", "decoded", "fault"
ROWS, PERIOD_MS = 40, 20
# The faults, by the word that the card gives them, and how they are told from the next likely one.
KINDS = {
    "standing": "position and clock stand still while the heartbeat goes on",
    "swapped": "the two words of the position come in the other order",
    "invalid": "position_valid is 0: the robot itself says that the position counts for nothing",
    "impossible": "one position is further off than the joint can go in 20 ms",
    "silent": "no answer came for longer than 100 ms",
    "heartbeat": "the robot no longer copies the heartbeat, all else goes on",
}


def draw(generator: np.random.Generator) -> Table:
    """Draw a motion, the fault, and the row that is to be decoded."""
    return {
        WIRE: {
            "start_deg": int(generator.integers(-80, 81)) / 2,
            "speed_deg_s": int(generator.integers(10, 60)) * (-1) ** int(generator.integers(2)),
            "clock_ms": int(generator.integers(70_000, 900_000)),
            "heartbeat": int(generator.integers(1, 20_000)),
            "kind": str(generator.choice(list(KINDS))),
            "row": int(generator.integers(18, 30)),
            # Before any fault begins: what is decoded is a right answer of the robot.
            "decode": int(generator.integers(4, 14)),
        }
    }


def material(given: Table, robot: Robot) -> dict[str, str]:
    """Return the table of the words."""
    del robot
    row = given[WIRE]
    lines = ["time_ms,position_valid,clock_low,clock_high,joint_1_low,joint_1_high,heartbeat_echo"]
    for k in range(ROWS):
        begun, kind = k >= int(row["row"]), row["kind"]
        shown = int(row["row"]) - 1 if kind == "standing" and begun else k
        valid, low_first = int(not (kind == "invalid" and begun)), not (kind == "swapped" and begun)
        # At its greatest speed the joint goes 9 degrees from one answer to the next.
        place = position(given, shown) + 90.0 * (kind == "impossible" and k == int(row["row"]))
        words = struct.pack("<i", clock(given, shown)) + struct.pack("<f", place)
        clock_low, clock_high, low, high = struct.unpack("<4H", words)
        if not low_first:
            low, high = high, low
        beat = int(row["heartbeat"])
        beat += int(row["row"]) - 1 if kind == "heartbeat" and begun else k
        cells = clock_low, clock_high, low, high, beat
        told = ",".join(f"{cell:04x}" for cell in cells)
        lines.append(f"{time(given, k)},{valid},{told}")
    decode = f"Decode the answer of time_ms {time(given, int(row['decode']))}.\n"
    return {"wire.csv": "\n".join(lines) + "\n", "decode.txt": decode}


def time(given: Table, k: int) -> int:
    """Return when answer k came [ms], on the clock of whoever asked."""
    late = given[WIRE]["kind"] == "silent" and k >= int(given[WIRE]["row"])
    return PERIOD_MS * k + 360 * late


def clock(given: Table, k: int) -> int:
    """Return the robot's clock at reading k [ms]."""
    return int(given[WIRE]["clock_ms"]) + time(given, k)


def position(given: Table, k: int) -> float:
    """Return joint_1 at reading k [deg]."""
    row = given[WIRE]
    return float(row["start_deg"]) + float(row["speed_deg_s"]) * time(given, k) / 1e3


def solve(given: Table, robot: Robot) -> Table:
    """Return the decoded row, the kind of fault, and when it began."""
    del robot
    k = int(given[WIRE]["decode"])
    fault = {"kind": given[WIRE]["kind"], "since_ms": time(given, int(given[WIRE]["row"]))}
    words: dict[str, float | str] = {
        "clock": clock(given, k),
        "joint_1_deg": round(position(given, k), 4),
    }
    return {DECODED: words, FAULT: fault}


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give."""
    right, k = solve(given, robot), int(given[WIRE]["decode"])
    at = clock(given, k)
    low, high = struct.unpack("<2H", struct.pack("<i", at))
    first, second = struct.unpack("<2H", struct.pack("<f", position(given, k)))
    (turned,) = struct.unpack("<f", struct.pack("<2H", second, first))
    begun = float(right[FAULT]["since_ms"])

    def other(part: str, **changed: float | str) -> Table:
        return {**right, part: {**right[part], **changed}}

    found = {
        "the low word comes first: put the high one before it": other(
            DECODED, joint_1_deg=turned, clock=float(low * 65536 + high)
        ),
        "the clock has two words: high times 65536, plus low": other(DECODED, clock=float(low)),
        "the number is a float32 as it stands, not a whole number": other(
            DECODED, joint_1_deg=float(second * 65536 + first)
        ),
        "the next row is the first that is wrong": other(FAULT, since_ms=begun - PERIOD_MS),
        "an earlier row is wrong already": other(FAULT, since_ms=begun + PERIOD_MS),
        "asked for is the time of the answer, not the number of its row": other(
            FAULT, since_ms=float(given[WIRE]["row"])
        ),
        "asked for is the time of the answer, not the robot's clock": other(
            FAULT, since_ms=float(clock(given, int(given[WIRE]["row"])))
        ),
    }
    for kind in KINDS:
        if kind != given[WIRE]["kind"]:
            found[f"look again, it is not so that {KINDS[kind]}"] = other(FAULT, kind=kind)
    return found
