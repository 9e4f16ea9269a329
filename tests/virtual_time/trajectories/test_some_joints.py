"""A trajectory over some joints: the real robot follows all of it, the other joints hold."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from harness.scenes.steps import ROBOT
from harness.virtual_cell.cell import VirtualCell
from scara_control.joint_motion import JointMotion
from scara_control.trajectory.goal import Code, Goal

NAMED = ("joint_1", "joint_3")
NAMES = ("joint_1", "joint_2", "joint_3", "table_joint")
WAY = ((0.3, -0.12), (0.6, -0.08))
DEG = np.pi / 180.0
CAUGHT_UP_S = 0.7
"""So long after a goal was accepted the robot has caught up with its start."""


def goal(names: tuple[str, ...], *rows: tuple[float, ...]) -> Goal:
    """Return a goal of one row each second, velocities left out, as most clients send it."""
    points = tuple(JointMotion(row, (), (), float(k)) for k, row in enumerate(rows, start=1))
    return Goal(names, points)


@cache
def driven(names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray, list[str], str]:
    """Return where both sides end, how far apart they were at most, decisions, how it ended."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        home = dict(zip(NAMES, cell.twin.truth[-1][1]))
        rows = [tuple({**home, **dict(zip(NAMED, row))}[name] for name in names) for row in WAY]
        begun = cell.schedule.now
        cell.twin.accept(goal(names, *rows))
        cell.wait_until(lambda: bool(cell.twin.ended), 15.0, "the trajectory to end")
        cell.wait_still(0.5)
        (ended,) = cell.twin.ended
        assert ended.code is Code.SUCCESSFUL, ended
        assert cell.twin.refused == []
        apart = _apart(cell, begun + CAUGHT_UP_S)
        ends = np.array([cell.real.truth[-1][1][: len(NAMES)], cell.twin.truth[-1][1]])
        return ends, apart, [decision.mode_after for decision in cell.decisions], ended.text


def _apart(cell: VirtualCell, begun: float) -> np.ndarray:
    """Return the largest difference of each joint at the same instant."""
    twin = np.array([(at, *q) for at, q, _ in cell.twin.truth if at >= begun])
    real = np.array([(at, *q) for at, q, _ in cell.real.truth if at >= begun])
    there = [np.interp(twin[:, 0], real[:, 0], real[:, 1 + k]) for k in range(len(NAMES))]
    return np.max(np.abs(np.array(there).T - twin[:, 1:]), axis=0)


def test_the_real_robot_goes_where_the_named_joints_go() -> None:
    """And is let alone in the others; the twin leads all the time, nothing is refused."""
    ends, _, modes, _ = driven(NAMED)
    wanted = [WAY[-1][0], 0.0, WAY[-1][1], 0.0]
    assert ends == pytest.approx(np.array([wanted, wanted]), abs=1e-3)
    assert "TWIN_LEADS" in modes
    assert not {"STOPPED", "FAULT", "PAUSED", "OPERATOR_LEADS", "REAL_LEADS"} & set(
        modes[modes.index("TWIN_LEADS") :]
    )


@pytest.mark.thorough
def test_it_is_followed_ahead_of_its_time_as_one_of_all_joints() -> None:
    """Naming two joints costs nothing: the sides are apart as little as if all were named.

    By what is measured alone the robot would be late by more than twice as much.
    """
    _, some, _, _ = driven(NAMED)
    _, whole, _, _ = driven(NAMES)
    assert some[[0, 2]] == pytest.approx(whole[[0, 2]], rel=0.2, abs=1e-5)
    assert some[0] < 0.02 * DEG
    assert max(some[1], some[3]) < 0.1 * DEG, "joints that hold"
