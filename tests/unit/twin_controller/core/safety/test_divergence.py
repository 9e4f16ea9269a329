"""The pair came apart when the real tool left the twin's recent path for k of n checks."""

from __future__ import annotations

from itertools import pairwise

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, shifted
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion
from twin_controller.core.safety.divergence import (
    DelayState,
    DivergenceState,
    judge,
    judge_delay,
    judge_divergence,
    path_distance,
)
from twin_controller.core.sides.side import Sides

replace = msgspec.structs.replace
CONFIG = SETUP.config.divergence
POINT = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@given(point=POINT, path=st.lists(POINT, min_size=1, max_size=6))
def test_path_distance_agrees_with_a_dense_search(
    point: tuple[float, float, float], path: list[tuple[float, float, float]]
) -> None:
    """Brute force over 400 points of each segment: never below them, hardly above."""
    found = path_distance(point, path)
    corners = np.array(path)
    if len(path) == 1:
        dense = corners
    else:
        shares = np.linspace(0.0, 1.0, 400)[:, None]
        dense = np.concatenate([a + shares * (b - a) for a, b in pairwise(corners)])
    brute = np.linalg.norm(dense - np.array(point), axis=1).min()
    longest = max((np.linalg.norm(b - a) for a, b in pairwise(corners)), default=0.0)
    assert found <= brute + 1e-9
    assert brute - found <= longest / 399.0 + 1e-9


@pytest.mark.parametrize(
    ("point", "path", "expected"),
    [
        ((0, 0, 1), [(0, 0, 0)], 1.0),
        ((0, 0, 1), [(0, 0, 0), (0, 0, 0)], 1.0),
        ((0.5, 0.2, 0), [(0, 0, 0), (1, 0, 0)], 0.2),
        ((2, 0, 0), [(0, 0, 0), (1, 0, 0)], 1.0),
        ((1, 1, 0), [(0, 0, 0), (1, 0, 0), (1, 1, 0)], 0.0),
    ],
)
def test_path_distance_of_simple_figures(
    point: tuple[float, float, float], path: list[tuple[float, float, float]], expected: float
) -> None:
    """A path that stands still is a point; beyond an end the end counts."""
    assert path_distance(point, path) == pytest.approx(expected)


def judged(*distances_mm: float, start: DivergenceState | None = None) -> DivergenceState:
    """Judge distances against a limit of 10 mm."""
    state = start or DivergenceState()
    for distance in distances_mm:
        state = judge(state, distance * 1e-3, 10.0, CONFIG)
    return state


@pytest.mark.parametrize(
    ("distances", "alarm"),
    [
        ((11.0,) * (CONFIG.confirm - 1), False),
        ((11.0,) * CONFIG.confirm, True),
        ((9.99,) * 100, False),
        ((11.0, 0.0) * CONFIG.confirm, False),
        ((11.0,) * (CONFIG.confirm - 1) + (0.0,) * CONFIG.window + (11.0,), False),
        ((11.0,) * CONFIG.confirm + (0.0,), True),
        ((11.0,) * CONFIG.confirm + (8.0,) * 100, True),
        ((11.0,) * CONFIG.confirm + (6.0,) * (CONFIG.window - 1), True),
        ((11.0,) * CONFIG.confirm + (6.0,) * CONFIG.window, False),
    ],
)
def test_the_alarm_is_k_of_n_with_a_hysteresis(distances: tuple[float, ...], alarm: bool) -> None:
    """After ``confirm`` of ``window`` checks, until a whole window is below the release limit."""
    assert judged(*distances).alarm is alarm


@given(noise=st.lists(st.floats(0.75, 1.25), max_size=200))
def test_a_distance_around_the_limit_never_toggles_the_alarm_twice(noise: list[float]) -> None:
    """Between release and limit the alarm stays what it is."""
    state, changes = DivergenceState(), 0
    for part in noise:
        new = judge(state, 10.0e-3 * part, 10.0, CONFIG)
        changes += new.alarm != state.alarm
        state = new
    assert changes <= 1


def test_the_distance_is_shown_in_millimetres() -> None:
    """Borders speak mm."""
    assert judged(3.5).distance_mm == pytest.approx(3.5)


def test_noise_of_each_joint_moves_the_tool_by_its_lever() -> None:
    """Of both vertical axes by the reach, of the slide by itself; as independent ones do."""
    of_a_degree = np.radians(1.0) * SETUP.reach_mm
    assert SETUP.tool_per_noise == pytest.approx(np.sqrt(2.0 * of_a_degree**2 + 1.0))


@pytest.mark.parametrize(("samples", "judges"), [(0, False), (1, False), (2, True)])
def test_a_twin_is_judged_from_its_second_sample_on(samples: int, judges: bool) -> None:
    """One may be damaged; the real robot needs but one, and without it nothing is known."""
    sides = idle_pair().state.sides
    twin = replace(sides.twin, history=sides.twin.history[len(sides.twin.history) - samples :])
    fresh = DivergenceState()
    assert (judge_divergence(SETUP, fresh, Sides(sides.real, twin)) != fresh) is judges
    assert judge_divergence(SETUP, fresh, Sides(replace(sides.real, history=()), twin)) == fresh


@pytest.mark.parametrize(("noise", "alarm"), [(0.0, True), (0.01, True), (0.05, False)])
def test_what_noise_alone_may_bring_is_no_divergence(noise: float, alarm: bool) -> None:
    """At rest 2.8 mm apart: beyond 2 mm, not beyond five deviations of 0.05 deg at full reach."""
    pair = idle_pair()
    pair.run(1.0)
    real, twin = pair.state.sides.real, pair.state.sides.twin
    apart = (twin.last.q[0] + 2.8e-3 / 0.65, *twin.last.q[1:])
    history = (*real.history[:-1], replace(real.last, q=apart))
    sides = Sides(replace(real, noise=noise, history=history), twin)
    state = DivergenceState()
    for _ in range(CONFIG.window):
        state = judge_divergence(SETUP, state, sides)
    assert state.distance_mm == pytest.approx(2.8, abs=0.1)
    assert state.alarm is alarm


def turning(sides: Sides, late: float, speed: float) -> Sides:
    """Return sides that turn joint 1 at ``speed`` [rad/s], the real robot ``late`` [s] behind."""

    def samples(behind: float) -> tuple[JointMotion, ...]:
        rest = (0.0,) * (len(SETUP.joints) - 1)
        return tuple(
            JointMotion.measured((speed * (k * 0.01 - behind), *rest), (speed, *rest), k * 0.01)
            for k in range(10)
        )

    return Sides(
        replace(sides.real, history=samples(late)), replace(sides.twin, history=samples(0.0))
    )


@pytest.mark.parametrize("late", [0.030, 0.0, -0.012])
def test_delay_is_told_as_the_time_by_which_the_real_robot_is_behind(late: float) -> None:
    """By the way that both go: a robot ahead of the twin counts below zero."""
    pair = idle_pair()
    state = DelayState()
    for _ in range(100):
        state = judge_delay(SETUP, state, turning(pair.state.sides, late, 0.8))
    assert state.late == pytest.approx(late, abs=2e-4)


@pytest.mark.parametrize("speed", [0.01, 0.06])
@pytest.mark.parametrize(("before", "late"), [(DelayState(), 0.0), (DelayState(late=0.02), 0.02)])
def test_delay_is_kept_while_the_tools_are_too_slow_to_tell(
    pair: Pair, before: DelayState, late: float, speed: float
) -> None:
    """A millimetre at rest is no time; a pair that has never moved has no delay."""
    state = judge_delay(SETUP, before, turning(pair.state.sides, 0.5, speed))
    assert state.late == late and state.judged.distance_mm > 1.0


@pytest.mark.parametrize(("commands", "judges"), [((), True), (("STOP",), False)])
def test_a_pair_at_rest_is_judged_while_it_is_to_be_together(
    pair: Pair, commands: tuple[str, ...], judges: bool
) -> None:
    """Also by less than what leads; after a stop how far both are apart is no fault."""
    for command in commands:
        pair.do(command)
    pair.run(1.0)
    apart = shifted(HOME, 0.01), (0.0,) * len(HOME)
    pair.real_at = lambda t: apart  # type: ignore[method-assign]
    pair.run(1.0)
    found = pair.state.safety.divergence.distance_mm
    assert found == pytest.approx(0.113 if judges else 0.0, abs=2e-3)
