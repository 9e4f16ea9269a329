"""Recorded samples: markers, order, cuts."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.report.record import RecordError, Span, build_side, cut, find_spans, pick


def columns(values: list[float]) -> Array:
    """Return one joint."""
    return np.array(values)[:, None]


def test_samples_that_do_not_go_forward_are_left_out() -> None:
    """A repeated or late stamp would bend the path backwards."""
    side = build_side(
        "twin",
        np.array([0.0, 1.0, 0.5, 1.0, 2.0]),
        columns([0, 1, 7, 8, 2]),
        columns([0, 0, 0, 0, 0]),
    )
    assert side.stamps.tolist() == [0.0, 1.0, 2.0]
    assert side.positions[:, 0].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("markers", "spans"),
    [
        ([(1.0, "start a"), (2.0, "end a")], (Span("a", 1.0, 2.0, True),)),
        (
            [(1.0, "start a"), (2.0, "end a"), (3.0, "start b"), (4.0, "end b")],
            (Span("a", 1, 2, True), Span("b", 3, 4, True)),
        ),
        ([(1.0, "start a")], (Span("a", 1.0, 9.0, False),)),
        (
            [(1.0, "start a"), (2.0, "start b"), (3.0, "end b")],
            (Span("a", 1, 2, False), Span("b", 2, 3, True)),
        ),
        ([(1.0, "start a"), (2.0, "end b")], (Span("a", 1.0, 2.0, False),)),
        ([(0.5, "end a"), (1.0, "start a"), (2.0, "end a")], (Span("a", 1.0, 2.0, True),)),
    ],
)
def test_markers_become_experiments(
    markers: list[tuple[float, str]], spans: tuple[Span, ...]
) -> None:
    """An experiment without its own end was not finished."""
    assert find_spans(markers, 9.0) == spans


@pytest.mark.parametrize("markers", [[], [(1.0, "end a")], [(1.0, "hello")]])
def test_a_recording_without_experiments_is_refused(markers: list[tuple[float, str]]) -> None:
    """The text says which marker was expected."""
    with pytest.raises(
        RecordError, match="no experiment was started: experiment/marker never said `start NAME`"
    ):
        find_spans(markers, 9.0)


def test_a_side_without_samples_is_named() -> None:
    """One-sided data are an error that says which side is missing."""
    with pytest.raises(RecordError, match="real: 0 samples"):
        build_side("real", np.array([]), np.zeros((0, 1)), np.zeros((0, 1)))


def test_a_cut_without_samples_says_where_there_are_some() -> None:
    """The reader sees whether clocks or recordings are apart."""
    motion = Motion("twin", np.array([0.0, 1.0]), columns([0, 1]), columns([0, 0]))
    with pytest.raises(
        RecordError,
        match=r"twin: 0 samples between 5.00 and 6.00 s; there are some from 0.00 to 1.00 s",
    ):
        cut(motion, 5.0, 6.0)
    assert len(cut(motion, 0.0, 1.0).stamps) == 2


def test_joints_are_picked_in_the_order_asked_for() -> None:
    """Forward kinematics takes its own order of joints."""
    motion = Motion("twin", np.array([0.0, 1.0]), np.array([[1.0, 2.0, 3.0]] * 2), np.zeros((2, 3)))
    assert pick(motion, [2, 0]).positions[0].tolist() == [3.0, 1.0]
