"""What the real robot may be told.

What is invalid is rejected, only speed is limited, and that is said.
"""

from __future__ import annotations

import math
import re

import pytest
from harness.pair import HOME, SETUP, shifted
from hypothesis import given
from hypothesis import strategies as st
from twin_controller.core.follow.limit import Passed, Rejected, check_setpoint, pass_setpoint
from twin_controller.core.follow.real import bounds_of

BOUNDS = bounds_of(SETUP)
DT, FRESH, AGE_LIMIT = 0.01, 0.0, 0.1
Q = tuple(0.5 * (low + high) for low, high in zip(BOUNDS.lower, BOUNDS.upper))


def replaced(joint: int, value: float) -> tuple[float, ...]:
    """Return the middle position with one joint changed."""
    return tuple(value if k == joint else q for k, q in enumerate(Q))


@pytest.mark.parametrize(
    "q",
    [Q, HOME, BOUNDS.lower, BOUNDS.upper, replaced(0, BOUNDS.upper[0] + 0.9 * BOUNDS.tolerance[0])],
)
def test_set_points_within_the_limits_are_valid(q: tuple[float, ...]) -> None:
    """Limits included, and numeric noise beyond them."""
    assert check_setpoint(q, BOUNDS) == ""


@pytest.mark.parametrize(
    ("q", "text"),
    [
        (Q[:3], r"3 positions for 4 joints"),
        ((*Q, 0.0), r"5 positions for 4 joints"),
        ((), r"0 positions for 4 joints"),
        (replaced(0, math.nan), r"joint_1 = nan is not finite"),
        (replaced(1, math.inf), r"joint_2 = inf is not finite"),
        (replaced(3, -math.inf), r"table_joint = -inf is not finite"),
        (replaced(0, 2.6), r"joint_1 = 2.6 rad is outside \[-2.58309, 2.58309\]"),
        (replaced(1, -2.7), r"joint_2 = -2.7 rad is outside"),
        (replaced(2, 0.001), r"joint_3 = 0.001 m is outside \[-0.21, 0\]"),
        (replaced(2, -0.3), r"joint_3 = -0.3 m is outside"),
    ],
)
def test_invalid_set_points_are_rejected_with_joint_value_and_range(
    q: tuple[float, ...], text: str
) -> None:
    """Never clamped, never repaired."""
    assert re.search(text, check_setpoint(q, BOUNDS))
    verdict = pass_setpoint(q, Q, DT, FRESH, 0.8, AGE_LIMIT, BOUNDS)
    assert isinstance(verdict, Rejected) and re.search(text, verdict.reason)


def test_noise_beyond_a_limit_is_sent_as_the_limit() -> None:
    """The robot itself refuses a set point outside its limits."""
    q = replaced(0, BOUNDS.upper[0] + 0.9 * BOUNDS.tolerance[0])
    verdict = pass_setpoint(q, None, 0.0, FRESH, 0.8, AGE_LIMIT, BOUNDS)
    assert verdict == Passed(replaced(0, BOUNDS.upper[0]), False, "")


@pytest.mark.parametrize(
    ("age", "passes"),
    [(0.0, True), (AGE_LIMIT, True), (AGE_LIMIT + 1e-6, False), (math.inf, False)],
)
def test_a_set_point_made_of_old_data_is_rejected(age: float, passes: bool) -> None:
    """Stale data never move the robot."""
    verdict = pass_setpoint(Q, None, 0.0, age, 0.8, AGE_LIMIT, BOUNDS)
    assert isinstance(verdict, Passed) is passes
    if isinstance(verdict, Rejected):
        assert re.search(r"the twin's data are .* ms old, allowed are 100 ms", verdict.reason)


@pytest.mark.parametrize(
    ("part", "passed", "limited"),
    [
        (0.0, True, False),
        (0.79, True, False),
        (0.95, True, False),
        (1.0, True, True),
        (1.19, True, True),
        (1.21, False, False),
    ],
)
@pytest.mark.parametrize("joint", range(4))
def test_steps_pass_are_slowed_down_or_rejected_by_their_speed(
    joint: int, part: float, passed: bool, limited: bool
) -> None:
    """Up to 80 % passes, faster is slowed to 80 %, still faster is rejected.

    Both limits have a margin: that of 80 % and that of the largest speed.
    """
    step = part * BOUNDS.velocity[joint] * DT
    verdict = pass_setpoint(replaced(joint, Q[joint] + step), Q, DT, FRESH, 0.8, AGE_LIMIT, BOUNDS)
    assert isinstance(verdict, Passed) is passed
    if isinstance(verdict, Rejected):
        assert re.search(
            rf"{BOUNDS.names[joint]} would step .* more than 1.2 times its largest speed",
            verdict.reason,
        )
        return
    assert verdict.limited is limited
    assert (
        bool(
            re.search(
                rf"{BOUNDS.names[joint]} at .* % of its largest speed, allowed 80 %", verdict.reason
            )
        )
        is limited
    )
    moved = abs(verdict.q[joint] - Q[joint]) / (BOUNDS.velocity[joint] * DT)
    assert moved == pytest.approx(0.8 if limited else part, abs=1e-9)


@given(
    steps=st.tuples(*[st.floats(-1.3, 1.3)] * 4),
    share=st.floats(0.01, 1.0),
    dt=st.floats(1e-4, 0.1),
)
def test_what_passes_is_within_the_limits_and_on_the_way(
    steps: tuple[float, ...], share: float, dt: float
) -> None:
    """A limited step has the direction of the wanted one.

    Nothing passes that is out of range or too fast.
    """
    q = tuple(p + part * v * dt for p, part, v in zip(Q, steps, BOUNDS.velocity))
    verdict = pass_setpoint(q, Q, dt, FRESH, share, AGE_LIMIT, BOUNDS)
    if isinstance(verdict, Rejected):
        return
    done = [a - b for a, b in zip(verdict.q, Q)]
    wanted = [a - b for a, b in zip(q, Q)]
    assert all(
        abs(step) <= v * dt * BOUNDS.step_margin * (1 + 1e-9)
        for step, v in zip(done, BOUNDS.velocity)
    )
    ratio = max((abs(a) for a in done), default=0.0) / max(max(abs(b) for b in wanted), 1e-300)
    assert done == pytest.approx([ratio * step for step in wanted], abs=1e-12)
    assert check_setpoint(verdict.q, BOUNDS) == ""


def test_the_bounds_are_those_of_the_robot_profile() -> None:
    """Names, limits and speeds come from robot.yaml."""
    assert BOUNDS.names == ("joint_1", "joint_2", "joint_3", "table_joint")
    assert check_setpoint(shifted(HOME, 147.9, 149.9, 159.9, 179.9), BOUNDS) == ""
    assert check_setpoint(shifted(HOME, 148.2), BOUNDS) != ""
