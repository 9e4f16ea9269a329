"""Many points at once give what each gives alone."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from scara_config import load_robot
from scara_control.errors import JointVectorError, ScaraControlError
from scara_control.kinematics.scara import Elbow, Scara, solve_elbow, tool_position

from bench.world.scara_batch import solve_batch, tool_positions_batch

ROBOT = load_robot()
SCARA = Scara.from_robot(ROBOT)
EDGES = [
    (0.65, 0.0, 0.0),
    (0.0, 0.65, 0.16),
    (0.65 + 1e-10, 0.0, 0.0),
    (0.66, 0.0, 0.0),
    (0.1, 0.0, 0.0),
    (0.0, 0.0, 0.0),
    (-0.6, 0.0, 0.0),
    (0.5, 0.0, -0.05),
    (0.5, 0.0, 0.17),
    (math.nan, 0.0, 0.0),
    (math.inf, 0.0, 0.0),
    (0.5, 0.0, math.nan),
]


def alone(scara: Scara, target: np.ndarray, elbow: Elbow) -> tuple[float, ...]:
    """Return the solution of one target, NaN for a refusal."""
    try:
        return solve_elbow(scara, *target.tolist(), elbow)
    except ScaraControlError:
        return (math.nan,) * 3


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("elbow", Elbow)
@pytest.mark.parametrize("upper_deg", [148.0, 360.0])
def test_batch_solves_and_refuses_what_the_single_function_does(elbow, upper_deg):
    """The same formulas, limits and tolerances, also where joint_1 may turn more than once."""
    first = msgspec.structs.replace(ROBOT.joints[0], lower_deg=-140.0, upper_deg=upper_deg)
    scara = Scara.from_robot(msgspec.structs.replace(ROBOT, joints=[first, *ROBOT.joints[1:]]))
    random = np.random.default_rng(2).uniform((-0.7, -0.7, -0.08), (0.7, 0.7, 0.2), (2000, 3))
    targets = np.vstack([EDGES, random])
    q, reachable = solve_batch(scara, targets, elbow)
    expected = np.array([alone(scara, target, elbow) for target in targets])
    np.testing.assert_allclose(q, expected, atol=1e-13)
    np.testing.assert_array_equal(reachable, np.isfinite(expected[:, 0]))
    assert 500 < reachable.sum() < 1500


def test_points_come_back_within_a_picometre():
    """Round trip of points all over the ring and on its edge."""
    rng = np.random.default_rng(3)
    q = rng.uniform((-2.5, 0.0, -0.21), (2.5, 2.6, 0.0), (20000, 3))
    q[:5000, 1] = 10.0 ** rng.uniform(-12.0, -1.0, 5000)
    q[:100, 1] = 0.0
    points = tool_positions_batch(SCARA, q)
    solutions = solve_batch(SCARA, points)
    assert solutions.reachable.all()
    assert np.abs(tool_positions_batch(SCARA, solutions.q) - points).max() < 1e-12


def test_positions_are_those_of_the_single_function():
    """The forward direction too."""
    q = np.random.default_rng(4).uniform(-2.0, 2.0, (100, 3))
    expected = [tool_position(SCARA, *row) for row in q]
    np.testing.assert_allclose(tool_positions_batch(SCARA, q), expected, atol=1e-15)


@pytest.mark.parametrize("function", [tool_positions_batch, solve_batch])
@pytest.mark.parametrize("shape", [(3,), (4, 2)])
def test_refuses_another_shape(function, shape):
    """One row is one point."""
    with pytest.raises(JointVectorError, match=r"expected \(m, 3\)"):
        function(SCARA, np.zeros(shape))
