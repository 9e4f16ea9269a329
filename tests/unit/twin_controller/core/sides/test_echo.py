"""A follower's answer to our commands is an echo; what leaves their tube is a motion of its own."""

from __future__ import annotations

import pytest
from harness.pair import SETUP
from hypothesis import given
from hypothesis import strategies as st
from twin_controller.core.sides.echo import EchoTube, answers, is_echo, remember

MEMORY, REST, TOLERANCE = 0.5, 0.025, 0.5


def tube_of(*commands: tuple[float, tuple[float, ...]]) -> EchoTube:
    """Return the tube of these commands."""
    tube = EchoTube()
    for t, q in commands:
        tube = remember(tube, [(t, q)], 1.0)
    return tube


MOVING = tube_of((0.0, (0.0, 5.0)), (0.1, (1.0, 5.0)), (0.2, (2.0, 5.0)))


@pytest.mark.parametrize(
    ("t", "q", "expected"),
    [
        (0.2, (1.0, 5.0), True),
        (0.2, (0.0, 5.0), True),
        (0.2, (2.5, 5.0), True),
        (0.2, (-0.5, 5.0), True),
        (0.2, (2.53, 5.0), False),
        (0.2, (-0.53, 5.0), False),
        (0.2, (1.0, 5.02), True),
        (0.2, (1.0, 5.03), False),
        (0.2, (1.0, 4.97), False),
        (0.55, (1.0, 5.0), True),
        (0.55, (0.4, 5.0), False),
        (0.65, (1.9, 5.0), False),
        (0.65, (2.0, 5.0), True),
        (0.71, (2.0, 5.0), False),
        (-0.55, (0.0, 5.0), False),
        (-0.45, (0.0, 5.0), True),
    ],
)
def test_the_tube_is_wide_only_for_joints_that_were_told_to_move(
    t: float, q: tuple[float, ...], expected: bool
) -> None:
    """Half a second of commands spans it; joint 2 was told to stay, so only noise is allowed."""
    assert is_echo(MOVING, t, q, MEMORY, REST, TOLERANCE) is expected


@pytest.mark.parametrize(("off", "echo"), [(0.0, True), (0.024, True), (0.026, False)])
def test_a_side_that_was_told_to_stay_may_be_off_by_its_threshold_and_rounding(
    off: float, echo: bool
) -> None:
    """0.02 degrees and half of the last decimal that counts, to both sides."""
    config = SETUP.config.change
    tube = tube_of((0.0, (0.0, 5.0)), (0.1, (0.0, 5.0)))
    for sign in (1.0, -1.0):
        assert answers(tube, 0.1, (0.0, 5.0 + sign * off), config) is echo


def test_without_commands_nothing_is_an_echo() -> None:
    """A side that was told nothing moves on its own."""
    assert not is_echo(EchoTube(), 0.0, (0.0,), MEMORY, REST, TOLERANCE)


def test_old_commands_are_forgotten_but_never_the_newest() -> None:
    """The memory is bounded in time."""
    tube = tube_of(*((0.1 * k, (float(k),)) for k in range(100)))
    assert tube.commands[-1] == (pytest.approx(9.9), (99.0,))
    assert all(t >= 9.9 - 1.0 - 1e-9 for t, _ in tube.commands)
    assert remember(tube, [(1e6, (0.0,))], 1.0).commands == ((1e6, (0.0,)),)


def test_new_commands_stand_instead_of_those_for_then_or_later() -> None:
    """A side is told a way anew, from the first place of it on."""
    tube = tube_of((0.0, (0.0,)), (0.1, (1.0,)), (0.2, (2.0,)), (0.3, (3.0,)))
    anew = [(0.1, (1.5,)), (0.25, (1.6,))]
    assert remember(tube, anew, 1.0).commands == ((0.0, (0.0,)), *anew)
    assert remember(tube, anew, 0.2).commands == tuple(anew)


@given(path=st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=40), lag=st.integers(0, 39))
def test_a_follower_that_lags_behind_its_commands_is_always_an_echo(
    path: list[float], lag: int
) -> None:
    """Wherever it is between the commands it was given within the memory."""
    tube = EchoTube()
    for k, value in enumerate(path):
        tube = remember(tube, [(0.01 * k, (value,))], 1.0)
    now = 0.01 * (len(path) - 1)
    assert is_echo(tube, now, (path[max(0, len(path) - 1 - lag)],), MEMORY, REST, TOLERANCE)
