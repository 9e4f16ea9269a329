"""Which gains are stable.

The same answer as a joint that is simulated step by step, and as Jury's criterion.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.pid import PidGains, compute_command
from scara_simulation.config import LoopGains, load_gains, load_simulation
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.tuning.stability import (
    KINDS,
    MOST_POSES,
    TOLERANCE,
    Plant,
    sample_plant,
    spectral_radius,
    stable_range,
    worst_radius,
)
from scara_simulation.world_io import World

DT = 1e-3
ROOT = Path(__file__).parents[4]
ROBOT = load_robot(ROOT / "config")
CONFIG = load_simulation(ROBOT, ROOT / "config")
GAINS = load_gains(ROBOT, ROOT / "config")
JOINTS = [joint.name for joint in ROBOT.twin_joints]
URDF = ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf"


def one(inertia, damping=0.0, bandwidth=0.0):
    """Give a plant of a single joint."""
    return Plant(np.array([[[inertia]]]), np.array([damping]), DT, bandwidth)


def grows(kind, gains, inertia, damping=0.0, steps=8000):
    """Simulate a joint by the PID of the simulator, beginning next to its set point.

    Say whether it runs away.
    """
    q, qdot, last, integral, largest = 1.0, 0.0, 0.0, 0.0, []
    free = msgspec.structs.replace(gains, i_clamp=1e15)
    for _ in range(steps):
        error, error_dot = (-q, -qdot) if kind == "position" else (1.0 - qdot, (last - qdot) / DT)
        last = qdot
        effort, integral = compute_command(free, integral, error, error_dot, DT)
        qdot += (effort - damping * qdot) / inertia * DT
        q += qdot * DT
        largest.append(abs(q if kind == "position" else 1.0 - qdot))
        if largest[-1] > 1e6:
            return True
    return max(largest[steps // 2 :]) > max(largest[: steps // 2])


@given(st.floats(0.01, 3.99), st.floats(0.01, 1.99), st.floats(1e-4, 2.0))
def test_one_joint_is_stable_exactly_where_jurys_criterion_says(a, b, c):
    """The poles of the position loop and the closed form draw the same border."""
    inertia = 0.7
    gains = PidGains(p=a * inertia / DT**2, d=b * inertia / DT, i=c * inertia / DT**3)
    margins = (8.0 - 2.0 * a - 4.0 * b - c, a * b - c * (1.0 - b))
    if min(map(abs, margins)) > 1e-3:
        assert (spectral_radius(one(inertia), [("position", gains)]) < 1.0) is (min(margins) > 0.0)


CASES = [
    ("position", PidGains(p=8000.0, d=200.0, i=50_000.0)),
    ("position", PidGains(p=8000.0, d=5.0, i=50_000.0)),
    ("position", PidGains(p=8000.0, i=1.0)),
    ("position", PidGains(p=3.0e6, d=400.0)),
    ("position", PidGains(p=8000.0, d=1900.0)),
    ("position", PidGains(p=8000.0, d=2100.0)),
    ("velocity", PidGains(p=100.0, i=100.0)),
    ("velocity", PidGains(p=2100.0)),
    ("velocity", PidGains(p=100.0, i=1e4, d=0.3)),
    ("velocity", PidGains(p=100.0, d=1.2)),
]


@pytest.mark.parametrize(("kind", "gains"), CASES)
def test_simulated_joint_runs_away_exactly_when_a_pole_lies_outside(kind, gains):
    """The check and the loop as it runs, PID and integrator, agree."""
    assert grows(kind, gains, 1.0) is (spectral_radius(one(1.0), [(kind, gains)]) > 1.0)


@pytest.mark.parametrize(("kind", "key"), [(kind, key) for kind in KINDS for key in "pid"])
def test_stable_range_ends_where_a_simulated_joint_begins_to_run_away(kind, key):
    """2 % inside nothing grows, 2 % outside it does."""
    gains = {
        "position": PidGains(p=8000.0, d=200.0, i=50_000.0),
        "velocity": PidGains(p=100.0, i=2000.0, d=0.1),
    }
    low, high = stable_range(one(1.0, damping=0.1), [LoopGains(**gains)], 0, kind, key)

    def runs_away(value):
        return grows(kind, msgspec.structs.replace(gains[kind], **{key: value}), 1.0, damping=0.1)

    assert not runs_away(0.98 * high)
    assert runs_away(1.02 * high)
    if low > 0.0:
        assert not runs_away(1.02 * low)
        assert runs_away(0.98 * low)


def test_integral_alone_has_no_stable_range():
    """Without d no p stabilises a joint that has an integral; None says so."""
    gains = [LoopGains(position=PidGains(p=0.0, i=1e6, d=0.0), velocity=PidGains())]
    assert stable_range(one(1.0), gains, 0, "position", "p") is None
    assert worst_radius(one(1.0), gains, 0, "position") > 1.0 + TOLERANCE


def test_joint_without_gains_is_not_called_unstable():
    """Tuning may begin at zero; an integral that nobody uses counts for nothing."""
    gains = [LoopGains(position=PidGains(), velocity=PidGains())]
    for kind in KINDS:
        assert worst_radius(one(1.0, damping=0.1), gains, 0, kind) <= 1.0 + TOLERANCE


def test_coupled_joints_bound_each_other():
    """What is stable for a joint beside a soft one need not be beside a stiff one."""
    matrix = np.array([[[1.0, 0.8], [0.8, 1.0]]])
    plant = Plant(matrix, np.zeros(2), DT)
    effective = 1.0 - 0.8**2

    def loops(b):
        return LoopGains(position=PidGains(p=1.0, d=b * effective / DT), velocity=PidGains())

    assert plant.group(0) == [0, 1]
    assert worst_radius(plant, [loops(1.9), loops(0.01)], 0, "position") < 1.0 + TOLERANCE
    assert worst_radius(plant, [loops(1.9), loops(1.9)], 0, "position") > 1.01


@pytest.mark.parametrize(("joints", "most"), [(4, 7**4), (6, 5**6), (7, 3**7), (9, 3**9)])
def test_more_joints_are_sampled_on_a_coarser_grid(joints, most):
    """Up to six as ever; the middle of each joint's range is always among them."""
    poses = []

    def mass_matrix(q):
        poses.append(q)
        return np.eye(len(q))

    sample_plant(mass_matrix, [(-1.0, 1.0)] * joints, [0.0] * joints, DT, 0.0)
    assert len(poses) == most <= MOST_POSES
    assert [0.0] * joints in poses


@pytest.fixture(scope="module")
def world():
    """Give the shipped cell."""
    with World(URDF, JOINTS, ROBOT.tool_frame, dt=CONFIG.dt, gravity=CONFIG.gravity_m_s2) as cell:
        yield cell


def shipped_plant(world, bandwidth):
    """Sample the shipped cell."""
    limits = [(joint.lower, joint.upper) for joint in ROBOT.twin_joints]
    return sample_plant(world.mass_matrix, limits, world.damping, CONFIG.dt, bandwidth)


@pytest.mark.parametrize("bandwidth", [0.0, CONFIG.tracking_bandwidth_rad_s])
def test_shipped_gains_are_stable_with_a_margin_of_two(world, bandwidth):
    """Plain or with computed torque, at every pose and for every mix of loops."""
    plant = shipped_plant(world, bandwidth)
    assert [plant.group(k) for k in range(4)] == [[0, 1], [0, 1], [2], [3]]
    for joint, loops in enumerate(GAINS):
        for kind in KINDS:
            gains = getattr(loops, kind)
            doubled = msgspec.structs.replace(
                gains, p=2.0 * gains.p, i=2.0 * gains.i, d=2.0 * gains.d
            )
            for each in (gains, doubled):
                changed = [
                    *GAINS[:joint],
                    msgspec.structs.replace(loops, **{kind: each}),
                    *GAINS[joint + 1 :],
                ]
                assert worst_radius(plant, changed, joint, kind) < 1.0


def worst_pose(world, plant, gains):
    """Return the pose whose position loops have the largest pole."""

    def radius(pose):
        matrices = np.array([world.mass_matrix(pose)])
        here = Plant(matrices, plant.damping, plant.dt, plant.bandwidth)
        return spectral_radius(here, [("position", loops.position) for loops in gains])

    return max(([0.0, elbow, -0.1, 0.0] for elbow in np.linspace(0.0, 2.6, 7)), key=radius)


@pytest.mark.parametrize("joint", range(4))
@pytest.mark.parametrize("model_based", [True, False])
def test_physics_engine_agrees_about_the_largest_p(world, joint, model_based):
    """Stable at 0.8 of the largest p, never at 1.5: that p holds for any mix of loops."""
    plant = shipped_plant(world, CONFIG.tracking_bandwidth_rad_s if model_based else 0.0)
    _, high = stable_range(plant, GAINS, joint, "position", "p")
    rests = []
    for factor in (0.8, 1.5):
        loops = msgspec.structs.replace(
            GAINS[joint], position=msgspec.structs.replace(GAINS[joint].position, p=factor * high)
        )
        gains = [*GAINS[:joint], loops, *GAINS[joint + 1 :]]
        start = worst_pose(world, plant, gains)
        models = joint_models(ROBOT, CONFIG, world.damping, world.friction)
        control = JointControl(
            models,
            gains,
            start,
            CONFIG.dt,
            world.inverse_dynamics if model_based else None,
            CONFIG.tracking_bandwidth_rad_s,
        )
        speeds = [0.0] * 4
        speeds[joint] = 10.0 * models[joint].standstill
        world.reset(start, speeds)
        moved = []
        for _ in range(1500):
            q, qdot = world.read()
            moved.append(abs(qdot[joint]))
            world.step(control.efforts(0.0, q, qdot))
        rests.append(max(moved[-200:]) < models[joint].standstill)
    assert rests == [True, False]
