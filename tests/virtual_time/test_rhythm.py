"""Set points reach the robot in its own rhythm (decision 0009), whatever that of the polls is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from harness.plants.variants import without_ring
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files
from twin_controller.core.actions import AnyAction, StreamReal

MS = 1e-3


@cache
def streamed() -> tuple[list[float], list[float], list[float]]:
    """Return when set points are sent, when they are decided, and the robot's clock ticks [s]."""
    sent: list[float] = []
    decided: list[float] = []

    def note(action: AnyAction) -> AnyAction:
        if isinstance(action, StreamReal):
            sent.append(action.send_at)
            decided.append(cell.clock())
        return action

    with VirtualCell(without_ring(load_files("fanuc_sr6ia")), tamper=note) as cell:
        cell.connect()
        cell.move_to(cell.files.robot.positions_m["P2"], 50.0)
        ticks = [at + cell.clock() - cell.schedule.now for at, _, _ in cell.real.truth]
    return sent, decided, ticks


def test_set_points_are_sent_in_the_spacing_of_the_robots_filters() -> None:
    """8 ms of the robot's clock apart, not the 9.7 ms of the polls."""
    sent, _, _ = streamed()
    spacing = [later - earlier for earlier, later in pairwise(sent)]
    assert len(spacing) > 50
    assert spacing == pytest.approx([8.0 * MS] * len(spacing), abs=0.3 * MS)
    assert np.mean(spacing) == pytest.approx(8.0 * MS, abs=0.01 * MS)


def test_set_points_keep_their_place_between_two_ticks_of_the_robot() -> None:
    """Always at the same part of its period, whenever the answer came that they are decided on."""
    sent, _, ticks = streamed()
    late = [min(at - tick for tick in ticks if tick <= at) for at in sent]
    half = 1.0 * MS  # so that a part of 0 and one of a whole period are neighbours
    assert np.ptp([(value + half) % (2.0 * MS) for value in late]) < 0.3 * MS


def test_set_points_are_decided_before_they_are_sent() -> None:
    """An answer that comes late leaves no hole."""
    sent, decided, _ = streamed()
    assert min(at - when for at, when in zip(sent, decided)) > 0.0
    assert max(at - when for at, when in zip(sent, decided)) > 9.7 * MS


@pytest.mark.thorough
def test_without_the_spacing_each_set_point_is_sent_at_once() -> None:
    """The test of the tests: with ``stream.period_ms: null`` they come as the answers do.

    First as the polls do, then each behind a tick of the robot's or at once behind a late one.
    """
    files = without_ring(load_files("fanuc_sr6ia"))
    stream = msgspec.structs.replace(files.controller.stream, period_ms=None)
    controller = msgspec.structs.replace(files.controller, stream=stream)
    sent: list[float] = []

    def note(action: AnyAction) -> AnyAction:
        if isinstance(action, StreamReal):
            sent.append(action.send_at)
        return action

    with VirtualCell(replace(files, controller=controller), tamper=note) as cell:
        cell.connect()
        cell.move_to(files.robot.positions_m["P2"], 50.0)
    spacing = np.diff(sent)
    assert spacing[:100] == pytest.approx(9.7 * MS, abs=0.05 * MS)
    assert np.ptp(spacing) > 5.0 * MS
