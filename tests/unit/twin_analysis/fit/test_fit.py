"""A fit finds what was changed on purpose.

It says nothing about what a recording does not show.
"""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest
from harness.running.thorough import thorough
from scara_config import load_robot
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.screws import ScrewModel, tool_positions
from scara_simulation.config import load_gains, load_simulation
from twin_analysis.fit.offline_twin_io import OfflineTwin, Packet
from twin_analysis.fit.search import errors, fit_twin
from twin_analysis.fit.twin_model import (
    LOOP,
    Choice,
    FloatArray,
    TwinModel,
    apply_vector,
    bounds_of,
    names_of,
    yaml_values,
)

CONFIG = Path(__file__).resolve().parents[4] / "config"
ROBOT = load_robot(CONFIG)
SIMULATION = load_simulation(ROBOT, CONFIG)
NAMES = [joint.name for joint in ROBOT.twin_joints]
GAINS = tuple(load_gains(ROBOT, CONFIG))
PLAIN = TwinModel(GAINS, (0.5, 0.2, 5.0, 0.2), (1.0, 0.5, 5.0, 0.5), 0.0, 0.0, False)
COMPUTED = TwinModel(GAINS, (0.5, 0.2, 5.0, 0.2), (1.0, 0.5, 5.0, 0.5), 150.0, 0.002, True)
ARM = Choice((0, 1, 2), True)
DURATION = 1.2


def pose(t: float) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Return a smooth motion of the arm: position, velocity, acceleration."""
    w = 2.0 * math.pi / 0.8
    rise, rate, bend = 1.0 - math.cos(w * t), w * math.sin(w * t), w * w * math.cos(w * t)
    sizes = (0.15, -0.2, 0.02, 0.0)
    centre = (0.0, 0.3, -0.10, 0.0)
    return (
        tuple(c + s * rise for c, s in zip(centre, sizes)),
        tuple(s * rate for s in sizes),
        tuple(s * bend for s in sizes),
    )


PACKETS = [
    Packet(0.01 * k + 0.001, (JointMotion(*pose(0.01 * k), time=0.01 * k),)) for k in range(120)
]


def tool_path(model: TwinModel) -> FloatArray:
    """Return the tool's path of a twin with these numbers."""
    twin = OfflineTwin(ROBOT, SIMULATION, ROBOT.description)
    _, joints = twin.run(
        model, PACKETS, COMPUTED.delay if model.feed_forward else 0.0, pose(0.0)[0], DURATION
    )
    return tool_positions(ScrewModel.from_robot(ROBOT), joints[:, :3])


def test_a_packet_leads_the_twin_along_all_its_set_points() -> None:
    """Half a period of the motion, in one packet."""
    twin = OfflineTwin(ROBOT, SIMULATION, ROBOT.description)
    way = tuple(JointMotion(*pose(0.01 * k), time=0.01 * k) for k in range(41))
    times, joints = twin.run(COMPUTED, [Packet(0.0, way)], COMPUTED.delay, pose(0.0)[0], 0.41)
    assert joints[-1] == pytest.approx(np.array(pose(float(times[-1]))[0]), abs=0.01)


def test_the_zero_vector_is_the_start() -> None:
    """A fit that changes nothing proposes nothing."""
    assert apply_vector(COMPUTED, ARM, np.zeros(len(names_of(ARM, NAMES, COMPUTED)))) == COMPUTED


@pytest.mark.thorough
def test_detuned_gains_are_found_again() -> None:
    """The article's twin, plain PID: detuned on purpose, brought back by the recording alone."""
    choice = Choice((0, 1), False)
    names = names_of(choice, NAMES, PLAIN)
    changed = np.array(
        [
            -0.7 if name.endswith(LOOP) else 0.6 if name.endswith("damping") else 0.0
            for name in names
        ]
    )
    start = apply_vector(PLAIN, choice, changed)
    real = tool_path(PLAIN)
    found = fit_twin(start, choice, NAMES, real, int(0.6 * len(real)), tool_path, 40)
    back = np.array(found.vector) + changed
    gains = [value for name, value in zip(names, back) if name.endswith(LOOP)]
    assert found.before[1].rms_mm / found.after[1].rms_mm > 5.0
    assert np.max(np.abs(gains)) < 0.05


def test_the_delay_is_found_again() -> None:
    """Stamps that are 4 ms wrong show as an error in proportion to the speed."""
    start = apply_vector(COMPUTED, Choice((), True), np.array([0.0, 0.2]))
    real = tool_path(COMPUTED)
    found = fit_twin(start, Choice((), True), NAMES, real, int(0.6 * len(real)), tool_path, 15)
    assert found.model.delay == pytest.approx(COMPUTED.delay, abs=2e-4)
    assert found.before[1].max_mm / found.after[1].max_mm > 5.0


@pytest.mark.parametrize(("twin", "seen"), [(PLAIN, 1.6), *thorough((COMPUTED, 1.0))])
def test_friction_is_seen_where_no_feed_forward_makes_up_for_it(
    twin: TwinModel, seen: float
) -> None:
    """Joint 2 of the robot has 1.6 times the friction; computed torque hides what it is told."""
    worn = msgspec.structs.replace(twin, friction=(1.0, 0.8, 5.0, 0.5))
    real = tool_path(worn)
    found = fit_twin(twin, Choice((1,), False), NAMES, real, int(0.6 * len(real)), tool_path, 30)
    assert found.model.friction[1] / twin.friction[1] == pytest.approx(seen, rel=0.05)


def test_the_search_keeps_to_its_budget() -> None:
    """No more simulations than asked for, and the best so far is the result."""
    calls = []

    def simulate(model: TwinModel) -> FloatArray:
        calls.append(model)
        return np.full((20, 3), model.delay)

    found = fit_twin(COMPUTED, Choice((), True), NAMES, np.zeros((20, 3)), 10, simulate, 12)
    assert found.evaluations == 12 and len(calls) == 14
    assert found.model.delay < COMPUTED.delay


def test_bounds_keep_the_delay_positive_and_the_bandwidth_below_the_physics() -> None:
    """Nothing is proposed that the loader would refuse."""
    lower, upper = bounds_of(ARM, NAMES, COMPUTED)
    for vector in (lower, upper):
        model = apply_vector(COMPUTED, ARM, vector)
        assert model.delay >= -1e-6 and model.bandwidth <= 250.2


def test_the_proposal_names_files_and_keys() -> None:
    """What is written is what the loaders read."""
    values = yaml_values(COMPUTED, ARM, NAMES)
    assert values["twin_controller.yaml"] == {("real", "sample_latency_ms"): 2.0}
    assert values["pid_gains.yaml"][("joint_1", "position", "p")] == pytest.approx(
        GAINS[0].position.p, rel=1e-3
    )
    assert ("joint_dynamics", "joint_2", "friction") in values["simulation.yaml"]


def test_errors_are_distances_in_mm() -> None:
    """Root mean square and largest of the tool's distances."""
    found = errors(np.zeros((2, 3)), np.array([[0.003, 0.004, 0.0], [0.0, 0.0, 0.0]]))
    assert found.max_mm == pytest.approx(5.0) and found.rms_mm == pytest.approx(
        5.0 / math.sqrt(2.0)
    )
