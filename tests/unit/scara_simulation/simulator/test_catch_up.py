"""A set point that has jumped is caught up with at a bounded speed, and reached exactly."""

from __future__ import annotations

import pytest
from scara_control.joint_motion import AxisMotion
from scara_simulation.catch_up import catch_up, has_jumped

VELOCITY, ACCELERATION, DT = 8.0, 40.0, 1e-3
REST: AxisMotion = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("step", "jumped"), [(1.0, False), (1.4, False), (1.6, True)])
def test_only_what_no_motion_does_is_a_jump(step: float, jumped: bool) -> None:
    """What a newer set point corrects is met at once, as ever."""
    wanted = (step * VELOCITY * DT, VELOCITY, 0.0)
    assert has_jumped(REST, wanted, VELOCITY, DT) is jumped


@pytest.mark.parametrize("gap", [0.05, -0.3, 2.0])
@pytest.mark.parametrize("speed", [0.0, 3.0, -6.0])
def test_it_is_reached_no_faster_than_the_joint_moves(gap: float, speed: float) -> None:
    """From rest, a set point that stands or goes on; then it is met to the last digit."""
    last, reached = REST, False
    for k in range(3000):
        wanted = (gap + speed * k * DT, speed, 0.0)
        motion = catch_up(last, wanted, VELOCITY, ACCELERATION, DT)
        assert abs(motion[0] - last[0]) <= VELOCITY * DT * (1.0 + 2e-3)
        last = motion
        if motion == wanted:
            reached = True
            break
    assert reached
