"""Literal histories of one joint that moves, for the rules of the storm's monitor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from harness.scenes.truth import Row
from harness.storm.rules.history import Deed, History, Joint, Told

DEG = math.radians(1.0)
PERIOD_S = 0.01
JOINTS = tuple(
    Joint(name, -2.0, 2.0, 400.0 * DEG, 2000.0 * DEG, 40_000.0 * DEG, DEG)
    for name in ("joint_1", "joint_2", "joint_3", "table_joint")
)
ENDS = 10.0
"""A history begins at 0 and ends here [s]."""


def moving(*spans: tuple[float, float, float], ends: float = ENDS) -> list[Row]:
    """Return the truth of a side whose joint 1 moves in each span: begin, end, speed [deg/s]."""
    q = 0.0
    rows: list[Row] = []
    for k in range(round(ends / PERIOD_S)):
        at = k * PERIOD_S
        speed = sum(v for begin, end, v in spans if begin <= at < end) * DEG
        rows.append((at, (q, 0.0, 0.0, 0.0), (speed, 0.0, 0.0, 0.0)))
        q += speed * PERIOD_S
    return rows


STANDS = moving()


def states(mode: str, leader: str = "", begin: float = 0.0, end: float = ENDS) -> list[Told]:
    """Return states of one mode, 20 a second."""
    return [Told(begin + 0.05 * k, mode, leader) for k in range(round((end - begin) / 0.05))]


def history(real: Sequence[Row] = STANDS, twin: Sequence[Row] = STANDS, **known: Any) -> History:
    """Return a history with these truths."""
    return History(0.0, JOINTS, {"real": real, "twin": twin}, ended=ENDS, **known)


def motion(sent: float, **fields: Any) -> Deed:
    """Return a command that may move both."""
    return Deed("MOVE", "motion", sent, fields.pop("until", sent), **fields)


def stop(sent: float, **fields: Any) -> Deed:
    """Return a stop that is acknowledged 0.01 s later."""
    return Deed("STOP", "stop", sent, sent, fields.pop("answered", sent + 0.01), **fields)


def release(sent: float, name: str = "RESET") -> Deed:
    """Return a release."""
    return Deed(name, "release", sent, sent, sent + 0.01)
