"""A move that is not stopped has to come to its target, or its zone proves nothing."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest
from harness.workspace import ROOT
from harness.zones.moves import ZoneCell, elsewhere
from scara_config import load_robot

ROBOT = load_robot(ROOT / "config")
TARGET = (0.5, -0.4, -0.1, 0.0)
SHORT = (0.5, -0.39, -0.1, 0.0)


def test_a_side_that_ends_elsewhere_is_named_with_its_joint() -> None:
    """The table has no target here, and a whole turn is the same place."""
    assert elsewhere(ROBOT, TARGET, TARGET, TARGET) == ""
    turned = (0.5 + 2.0 * math.pi, -0.4, -0.1, 0.3)
    assert elsewhere(ROBOT, TARGET, turned, TARGET) == ""
    assert elsewhere(ROBOT, TARGET, SHORT, TARGET).startswith("real: joint_2 ends 0.57 deg")
    low = (0.5, -0.4, -0.1002, 0.0)
    assert elsewhere(ROBOT, TARGET, TARGET, low).startswith("twin: joint_3 ends -0.20 deg or mm")


@pytest.mark.parametrize(
    ("mode", "answer", "end", "said"),
    [
        ("IDLE", (True, ""), TARGET, ""),
        ("FAULT", (True, ""), TARGET, "FAULT: why"),
        ("IDLE", (False, "refused: it moves"), TARGET, "refused: it moves"),
        ("IDLE", (True, "done"), SHORT, "twin: joint_2 ends 0.57 deg or mm from the target"),
    ],
    ids=["there", "another mode", "refused", "the way was left"],
)
def test_a_move_that_is_not_stopped_ends_at_its_target_or_is_wrong(
    mode: str, answer: tuple[bool, str], end: tuple[float, ...], said: str
) -> None:
    """And was answered with success."""
    real, twin = (SimpleNamespace(truth=[(0.0, q, q)]) for q in (TARGET, end))
    cell: Any = SimpleNamespace(
        mode=mode,
        why="why",
        _answer=answer,
        real=real,
        twin=twin,
        files=SimpleNamespace(robot=ROBOT),
    )
    assert ZoneCell._unexpected(cell, TARGET) == said
