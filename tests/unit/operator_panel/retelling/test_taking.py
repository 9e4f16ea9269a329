"""A message becomes part of the snapshot, whichever version recorded it."""

from __future__ import annotations

import math
from types import SimpleNamespace

from operator_panel.retelling.taking import with_state
from operator_panel.view.snapshot import RECENT_S, Snapshot

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
    without = {name: value for name, value in OLD.items() if name != "deviation_mm"}
    assert with_state(Snapshot(), SimpleNamespace(**without), 1.0, "12:00:00").state == state


def test_a_peak_between_two_looks_is_kept_for_the_next_one() -> None:
    """Each distance while a side leads, until every look has seen it."""
    tools = {"real_tool": point(0.5, 0.1, 0.0), "twin_tool": point(0.5, 0.1, 0.001), "lag": 0.0}
    snapshot = Snapshot()
    for at, leader, apart in ((1.0, "", 9.0), (1.01, "real", 0.5), (1.02, "real", 7.0)):
        told = {**OLD, **tools, "leader": leader, "deviation_mm": apart}
        snapshot = with_state(snapshot, SimpleNamespace(**told), at, "12:00:00")
    assert snapshot.apart == ((1.01, 0.5), (1.02, 7.0))
    later = SimpleNamespace(**{**OLD, **tools, "deviation_mm": 0.1})
    at = 1.1 + RECENT_S
    assert with_state(snapshot, later, at, "12:00:00").apart == ((at, 0.1),)


def test_when_a_stop_was_seen_last_is_kept_while_its_mode_is_gone() -> None:
    """What was asked for before it is older, even if the pair has been aligned meanwhile."""
    snapshot = Snapshot()
    seen = []
    modes = ("STOPPED", "IDLE", "TWIN_LEADS", "STOPPED", "STOPPED", "ALIGNING", "IDLE", "ESTOP")
    for at, mode in enumerate(modes):
        told = SimpleNamespace(**{**OLD, "mode": mode})
        snapshot = with_state(snapshot, told, float(at), "12:00:00")
        seen.append(snapshot.ended)
    assert seen == [-math.inf, -math.inf, -math.inf, 3.0, 3.0, 3.0, 3.0, 7.0]
