"""The physics of the shipped URDF.

It obeys mechanics, repeats bitwise, and is controlled as promised.
"""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scara_config import ConfigError, load_robot
from scara_control.joint_track import JointTrack
from scara_simulation.config import load_gains, load_simulation
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.model import joint_models
from scara_simulation.simulation import Simulation, SimulationError, Timing
from scara_simulation.world_io import World

ROOT = Path(__file__).parents[4]
ROBOT = load_robot(ROOT / "config")
CONFIG = load_simulation(ROBOT, ROOT / "config")
GAINS = load_gains(ROBOT, ROOT / "config")
JOINTS = [joint.name for joint in ROBOT.twin_joints]
URDF = ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf"
START = ROBOT.home_positions
REACH = ROBOT.reach_mm / 1e3
ELBOWS = [-2.6, -1.2, 0.0, 0.8, 2.0, 2.6]


@pytest.fixture
def world():
    """Give the shipped cell."""
    with World(URDF, JOINTS, ROBOT.tool_frame, dt=CONFIG.dt, gravity=CONFIG.gravity_m_s2) as cell:
        yield cell


def simulation(world, feed_forward=True):
    """Give the shipped control on a world, with a snapshot each step."""
    models = joint_models(ROBOT, CONFIG, world.damping, world.friction)
    control = JointControl(
        models,
        GAINS,
        START,
        CONFIG.dt,
        world.inverse_dynamics if feed_forward else None,
        CONFIG.tracking_bandwidth_rad_s,
    )
    return Simulation(world, control, START, Timing(CONFIG.step_ns, 0, 1, 50))


def tool(q):
    """Return the tool's position by closed-form kinematics."""
    l1, l2, h = (v / 1e3 for v in (ROBOT.geometry.l1_mm, ROBOT.geometry.l2_mm, ROBOT.geometry.h_mm))
    q1, q12 = q[0], q[0] + q[1]
    return np.array(
        [l1 * math.cos(q1) + l2 * math.cos(q12), l1 * math.sin(q1) + l2 * math.sin(q12), h + q[2]]
    )


def smooth_moves(poses, duration):
    """Return set points that go through the poses, at rest in each.

    As fast as quintics of ``duration`` do.
    """
    times = [k * duration for k in range(len(poses))]
    zeros = [[0.0] * len(JOINTS)] * len(poses)
    return JointTrack(
        times, poses, zeros, zeros, extrapolation_limit=0.05, stop_accelerations=[1.0] * len(JOINTS)
    )


POSITIONS = [
    ([0.0, 0.0, -0.160], [0.65, 0.0, 0.0]),
    ([-14.3218, 69.6000, -0.060], [0.51, 0.16, 0.10]),
    ([-49.1577, 69.6000, 0.0], [0.51, -0.16, 0.16]),
    ([49.1577, -69.6000, -0.060], [0.51, 0.16, 0.10]),
]


@pytest.mark.parametrize(("joints_deg_m", "xyz"), POSITIONS)
def test_tool_stands_where_the_article_says(world, joints_deg_m, xyz):
    """The URDF's tool at the joint values of the article's positions."""
    q1, q2, q3 = joints_deg_m
    world.reset([math.radians(q1), math.radians(q2), q3, 0.7])
    assert world.link_position(ROBOT.tool_frame) == pytest.approx(xyz, abs=1e-5)


@pytest.mark.parametrize("elbow", ELBOWS)
def test_mass_matrix_is_symmetric_and_positive(world, elbow):
    """Kinetic energy is positive for every motion."""
    matrix = np.array(world.mass_matrix([0.3, elbow, -0.1, 0.5]))
    assert matrix == pytest.approx(matrix.T, abs=1e-12)
    assert np.linalg.eigvalsh(matrix).min() > 0.0


def test_inverse_dynamics_is_mass_matrix_times_acceleration_plus_gravity(world):
    """The two calls of the engine tell the same mechanics; only joint 3 carries weight."""
    q, acceleration = [0.3, 0.8, -0.1, 0.5], [1.0, -2.0, 0.5, 3.0]
    weight = world.inverse_dynamics(q, [0.0] * 4, [0.0] * 4)
    efforts = world.inverse_dynamics(q, [0.0] * 4, acceleration)
    assert np.subtract(efforts, weight) == pytest.approx(
        np.array(world.mass_matrix(q)) @ acceleration, abs=1e-9
    )
    assert weight[0] == pytest.approx(0.0, abs=1e-9)
    assert weight[2] == pytest.approx(world.mass_matrix(q)[2][2] * CONFIG.gravity_m_s2)


def test_free_fall_is_gravity_less_friction(world):
    """Joint 3 without effort falls as its weight, damping and dry friction say."""
    world.reset([0.0, 0.0, 0.0, 0.0])
    mass = world.mass_matrix([0.0] * 4)[2][2]
    friction, damping = world.friction[2], world.damping[2]
    for _ in range(100):
        world.step([0.0] * 4)
    terminal = (mass * CONFIG.gravity_m_s2 - friction) / damping
    assert world.read()[1][2] == pytest.approx(
        -terminal * (1.0 - math.exp(-damping / mass * 0.1)), rel=2e-3
    )


def test_energy_falls_by_what_friction_takes(world):
    """Without effort the kinetic energy of the arm only falls, by damping and dry friction."""
    world.reset([0.0, 1.0, -0.1, 0.0], [2.0, -1.0, 0.0, 1.0])
    balance = world.mass_matrix([0.0] * 4)[2][2] * CONFIG.gravity_m_s2
    lost = 0.0
    energies = []
    for _ in range(200):
        q, qdot = world.read()
        energies.append(0.5 * np.array(qdot) @ np.array(world.mass_matrix(q)) @ qdot)
        lost += (
            sum(d * v * v + f * abs(v) for d, f, v in zip(world.damping, world.friction, qdot))
            * CONFIG.dt
        )
        world.step([0.0, 0.0, balance, 0.0])
    assert energies[-1] < energies[0]
    assert energies[0] - energies[-1] == pytest.approx(lost, rel=0.01)


def test_dry_friction_holds_against_a_small_effort(world):
    """A joint at rest stays at rest below its dry friction and leaves above it."""
    world.reset(START)
    for share, moves in ((0.9, False), (1.1, True)):
        for _ in range(100):
            world.step(
                [
                    0.0,
                    0.0,
                    world.inverse_dynamics(START, [0.0] * 4, [0.0] * 4)[2],
                    share * world.friction[3],
                ]
            )
        assert (abs(world.read()[1][3]) > 1e-3) is moves


def test_tool_stands_on_the_stand_and_goes_no_deeper(world):
    """A stand is below position 1: the arm touches what is around it, and nothing at first."""
    sim = simulation(world)
    sim.advance(10)
    assert world.contacts() == 0
    lowest = ROBOT.joint("joint_3").lower
    sim.control.command_position("joint_3", lowest)
    height = sim.advance(1500)[-1].positions[2]
    assert world.contacts() > 0
    assert START[2] > height > lowest + 0.01


def test_reset_returns_to_bitwise_the_same_start(world):
    """Nothing of the past is left after a reset."""
    runs = []
    for _ in range(2):
        sim = simulation(world)
        sim.control.command_track(JOINTS, smooth_moves([START, [0.5, 1.0, -0.05, 1.0]], 0.3))
        runs.append([(s.positions, s.velocities, s.efforts) for s in sim.advance(400)])
    assert runs[0] == runs[1]


def test_two_processes_compute_bitwise_the_same():
    """The same inputs give the same states in every process."""
    code = (
        f"import sys; sys.path[:0] = {sys.path!r}; sys.path.insert(0, "
        f"{str(Path(__file__).parent)!r})\n"
        "import test_world as t\n"
        "with t.World(t.URDF, t.JOINTS, t.ROBOT.tool_frame, dt=t.CONFIG.dt, "
        "gravity=t.CONFIG.gravity_m_s2) as world:\n"
        "    sim = t.simulation(world)\n"
        "    sim.control.command_track(t.JOINTS, t.smooth_moves([t.START, [0.5, 1.0, -0.05, "
        "1.0]], 0.3))\n"
        "    last = sim.advance(400)[-1]\n"
        "print([v.hex() for v in last.positions + last.velocities + last.efforts])"
    )
    outputs = [
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
        ).stdout.splitlines()
        for _ in range(2)
    ]
    assert outputs[0][-1].startswith("['0x")
    assert outputs[0][-1] == outputs[1][-1]


STEPS = [
    (0, 0.3),
    (0, -5.0),
    (0, 60.0),
    (1, 0.3),
    (1, 5.0),
    (1, -60.0),
    (2, 3.0),
    (2, 20.0),
    (2, 100.0),
    (3, 0.3),
    (3, -10.0),
]


@pytest.mark.parametrize(("joint", "step"), STEPS)
def test_position_step_is_reached_without_overshoot(world, joint, step):
    """Overshoot below 2 %, 0.01 deg or mm off after a second, effort within its limit."""
    sim, scale = simulation(world), ROBOT.joint(JOINTS[joint]).scale
    sim.control.command_position(JOINTS[joint], START[joint] + step * scale)
    travelled = [(s.positions[joint] - START[joint]) / scale for s in sim.advance(1000)]
    assert sim.control.saturated_steps == 0
    assert max(value / step for value in travelled) < 1.02
    assert travelled[-1] == pytest.approx(step, abs=0.01)


@pytest.mark.parametrize("joint", [0, 1, 3])
def test_plain_pid_is_the_articles_baseline(world, joint):
    """The gains alone do the work of a step: no overshoot, nothing left in the end."""
    sim, scale = simulation(world, feed_forward=False), ROBOT.joint(JOINTS[joint]).scale
    sim.control.command_position(JOINTS[joint], START[joint] + 2.0 * scale)
    travelled = [(s.positions[joint] - START[joint]) / scale for s in sim.advance(3000)]
    assert max(travelled) < 2.0 * 1.02
    assert travelled[-1] == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(("joint", "speed"), [(0, 2.0), (1, 3.0), (2, 0.3), (3, 1.5)])
def test_velocity_step_is_reached_without_overshoot(world, joint, speed):
    """Within 2 % from 30 ms after the time that the joint's acceleration needs."""
    sim = simulation(world)
    sim.control.command_velocity(JOINTS[joint], speed)
    needed = round(speed / ROBOT.joint(JOINTS[joint]).acceleration / CONFIG.dt) + 30
    speeds = [s.velocities[joint] / speed for s in sim.advance(needed + 100)]
    assert max(speeds) < 1.02
    assert speeds[needed:] == pytest.approx([1.0] * 100, abs=0.02)
    assert sim.control.saturated_steps == 0


@pytest.mark.parametrize(
    ("feed_forward", "at_most_percent", "at_least_percent"), [(True, 0.02, 0.0), (False, 5.0, 0.2)]
)
def test_tool_follows_fast_moves_by_feed_forward(
    world, feed_forward, at_most_percent, at_least_percent
):
    """It is percent of the reach; without the feed-forward more than ten times larger."""
    poses = (
        [START]
        + [[math.radians(q[0]), math.radians(q[1]), q[2], 0.5] for q, _ in POSITIONS[1:3]]
        + [START]
    )
    track = smooth_moves(poses, 0.25)
    sim = simulation(world, feed_forward)
    sim.control.command_track(JOINTS, track)
    worst = max(
        np.linalg.norm(tool(track.sample(s.stamp_ns * 1e-9)[0]) - tool(s.positions))
        for s in sim.advance(900)
    )
    assert at_least_percent < worst / REACH * 100.0 < at_most_percent


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_loops_are_stable_with_a_gain_margin_of_two(world, factor):
    """All position loops together, at the physics rate and every elbow angle."""
    dt, n = CONFIG.dt, len(JOINTS)
    p, d = (
        np.diag([getattr(gains.position, name) for gains in GAINS]) * factor for name in ("p", "d")
    )
    for elbow in np.linspace(-2.6, 2.6, 27):
        mobility = np.linalg.inv(np.array(world.mass_matrix([0.0, elbow, -0.1, 0.0]))) * dt
        after_velocity = np.hstack([-mobility @ p, np.eye(n) - mobility @ d])
        closed = np.vstack(
            [np.hstack([np.eye(n), np.zeros((n, n))]) + dt * after_velocity, after_velocity]
        )
        assert abs(np.linalg.eigvals(closed)).max() < 0.98


def test_wrong_joints_and_links_are_refused():
    """The URDF and robot.yaml must speak of the same joints."""
    with pytest.raises(
        ConfigError, match=r"movable joints are joint_1, .*; robot\.yaml moves joint_1, joint_9"
    ):
        World(URDF, ["joint_1", "joint_9"], "tool0", dt=1e-3, gravity=9.81)
    with pytest.raises(ConfigError, match="has no link tool9"):
        World(URDF, JOINTS, "tool9", dt=1e-3, gravity=9.81)
    with pytest.raises(ConfigError, match=r"missing\.urdf: cannot be read"):
        World(URDF.with_name("missing.urdf"), JOINTS, "tool0", dt=1e-3, gravity=9.81)


def test_massless_links_stay_massless(tmp_path):
    """PyBullet would give a frame without inertia 1 kg."""
    frame = (
        '<link name="extra"/><joint name="e" type="fixed"><parent link="tool0"/><child '
        'link="extra"/></joint></robot>'
    )
    urdf = tmp_path / "cell.urdf"
    urdf.write_text(URDF.read_text().replace("</robot>", frame))
    weights = []
    for path in (URDF, urdf):
        with World(path, JOINTS, "tool0", dt=1e-3, gravity=9.81) as cell:
            weights.append(cell.inverse_dynamics(START, [0.0] * 4, [0.0] * 4)[2])
    assert weights[1] == pytest.approx(weights[0])


def test_simulation_that_left_the_numbers_ends():
    """A position that is no number is never published."""

    class Broken:
        def read(self):
            return [math.nan] * 4, [0.0] * 4

        def step(self, efforts):
            pass

        def reset(self, positions):
            pass

    control = JointControl(
        joint_models(ROBOT, CONFIG, [0.0] * 4, [0.0] * 4), GAINS, START, CONFIG.dt, None
    )
    with pytest.raises(SimulationError, match="step 5: joint positions are"):
        Simulation(Broken(), control, START, Timing(CONFIG.step_ns, 0, 5, 50)).advance(10)
