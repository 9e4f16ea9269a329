"""A message becomes part of the snapshot, whichever version recorded it."""

from __future__ import annotations

import math
from types import SimpleNamespace

from operator_panel.retelling.taking import with_state
from operator_panel.view.snapshot import Snapshot

OLD = {"mode": "REAL_LEADS", "leader": "real", "why": "", "links": [], "deviation_mm": 0.07}
"""A message from before both sides were told at one instant: its distance had the lag removed."""


def point(x: float, y: float, z: float) -> SimpleNamespace:
    """Return a geometry_msgs/Point."""
    return SimpleNamespace(x=x, y=y, z=z)


def test_tools_and_distance_of_one_instant_are_taken() -> None:
    """As they are: a distance that is not known stays unknown."""
    tools = {"real_tool": point(0.5, 0.1, 0.0), "twin_tool": point(0.5, 0.1, 0.001)}
    message = SimpleNamespace(**{**OLD, **tools, "deviation_mm": 1.0, "lag": 0.02})
    state = with_state(Snapshot(), message, 1.0, "12:00:00").state
    assert state is not None
    assert (state.real_tool, state.twin_tool) == ((0.5, 0.1, 0.0), (0.5, 0.1, 0.001))
    assert (state.deviation_mm, state.lag) == (1.0, 0.02)


def test_distance_of_an_older_recording_is_not_taken_for_another_one() -> None:
    """The recording is shown all the same; how far the tools were apart is not known."""
    state = with_state(Snapshot(), SimpleNamespace(**OLD), 1.0, "12:00:00").state
    assert state is not None and state.mode == "REAL_LEADS"
    assert math.isnan(state.deviation_mm) and math.isnan(state.real_tool[0])
