"""The servo model: limits always, exact rest, a constant lag."""

import math
import random
from itertools import pairwise

import msgspec
import numpy as np
import pytest
import ruckig
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.drives.axis import (
    Axis,
    AxisParameters,
    CommandLimiter,
    Friction,
    MovingAverage,
    Standstill,
)
from fanuc_emulator.plant.config import axis_parameters
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import Robot

DT = 0.002
PARAMETERS = AxisParameters(
    lower=-2.5,
    upper=2.5,
    velocity=7.5,
    program_acceleration=35.0,
    command_acceleration=55.0,
    servo_acceleration=75.0,
    estop_deceleration=90.0,
    natural_frequency=138.0,
    damping=0.8,
    velocity_feedforward=0.78,
    resolution=6e-7,
    tolerance=1e-5,
)
TARGETS = st.lists(
    st.tuples(st.floats(-4.0, 4.0), st.sampled_from([0.0, 0.1, 0.8, 1.0]), st.integers(1, 80)),
    min_size=1,
    max_size=25,
)


def new_axis(position: float = 0.0) -> Axis:
    """Return an axis with the parameters above, at rest."""
    return Axis(PARAMETERS, (5, 10), position, DT, 2)


def test_moving_average_of_a_step_is_a_ramp() -> None:
    """Set points held for 10 ms come out of a 10 ms average as straight lines."""
    average = MovingAverage(5, 0.0)
    assert [average.step(1.0) for _ in range(6)] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0, 1.0])
    average.reset(3.0)
    assert average.step(3.0) == 3.0


@given(TARGETS)
def test_command_keeps_every_limit_whatever_comes(targets: list[tuple[float, float, int]]) -> None:
    """Range, speed and acceleration of the command hold for any stream and any speed change."""
    limiter, dt = CommandLimiter(PARAMETERS, 0.0, DT), DT
    for target, speed, steps in targets:
        for _ in range(steps):
            before = limiter.velocity
            limiter.step(target, speed)
            assert PARAMETERS.lower <= limiter.position <= PARAMETERS.upper
            assert abs(limiter.velocity) <= PARAMETERS.velocity * (1 + 1e-12)
            assert abs(limiter.velocity - before) <= PARAMETERS.command_acceleration * dt * (
                1 + 1e-9
            )


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_set_point_that_runs_out_of_the_range_is_braked_before_its_end(way: float) -> None:
    """The command can always stop before the end, and comes to it; it never waits for the end."""
    limiter, most = CommandLimiter(PARAMETERS, 0.0, DT), PARAMETERS.command_acceleration
    seen = 0.0
    for k in range(1000):
        limiter.step(way * 7.0 * DT * k, 1.0)
        speed, ahead = way * limiter.velocity, 2.5 - way * limiter.position
        assert speed**2 <= 2.0 * most * (ahead + speed * DT) + 1e-9
        seen = max(seen, speed)
    assert seen > 6.9 and ahead == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(TARGETS)
def test_motor_keeps_every_limit_whatever_comes(targets: list[tuple[float, float, int]]) -> None:
    """The motor itself never leaves its range, its greatest speed and its torque's acceleration."""
    axis = new_axis()
    for target, speed, steps in targets:
        for _ in range(steps):
            before = axis.velocity
            axis.step(target, speed)
            assert PARAMETERS.lower <= axis.position <= PARAMETERS.upper
            assert abs(axis.velocity) <= PARAMETERS.velocity
            stopped_by_end = axis.velocity == 0.0 and axis.position in (
                PARAMETERS.lower,
                PARAMETERS.upper,
            )
            assert (
                abs(axis.velocity - before) <= PARAMETERS.servo_acceleration * DT * (1 + 1e-9)
                or stopped_by_end
            )


@settings(max_examples=30, deadline=None)
@given(TARGETS, st.floats(-2.5, 2.5))
def test_axis_comes_to_rest_exactly_at_its_last_target(
    targets: list[tuple[float, float, int]], last: float
) -> None:
    """After any history a constant target is reached exactly, and then nothing moves any more."""
    axis = new_axis()
    for target, speed, steps in targets:
        for _ in range(steps):
            axis.step(target, speed)
    for _ in range(3000):
        axis.step(last, 1.0)
    assert axis.resting
    assert axis.position == pytest.approx(last, abs=1e-12)
    assert axis.velocity == 0.0


@settings(max_examples=30, deadline=None)
@given(TARGETS, st.floats(-3.0, 3.0))
def test_still_axis_has_nothing_left_to_do(
    targets: list[tuple[float, float, int]], last: float
) -> None:
    """Whoever computes on finds the same bits; another speed each time makes it compute."""
    axis = new_axis()
    for target, speed, steps in targets:
        for _ in range(steps):
            axis.step(target, speed)
    assert any(axis.step(last, 1.0) for _ in range(4000))
    there = (axis.position, axis.velocity, axis.command, axis.command_velocity)
    for k in range(40):
        assert axis.step(last, (0.5, 1.0)[k % 2])
        assert (axis.position, axis.velocity, axis.command, axis.command_velocity) == there


def test_a_motor_that_swings_does_not_rest_at_the_turns_of_its_swing() -> None:
    """It is slow there too, for one look; what rests stays slow."""
    axis = Axis(msgspec.structs.replace(PARAMETERS, damping=0.05), (5, 10), 0.0, DT, 2)
    looked: list[tuple[float, bool]] = []
    for _ in range(4_000):
        axis.step(0.3, 1.0)
        looked.append((axis.position, axis.resting))
    first = next(k for k, (_, rests) in enumerate(looked) if rests)
    assert all(rests for _, rests in looked[first:])
    assert all(abs(q - 0.3) <= PARAMETERS.resolution for q, _ in looked[first:])
    steps = [abs(b - a) for (a, _), (b, _) in pairwise(looked[200:first])]
    assert sum(step < PARAMETERS.resolution for step in steps) > 3, "turns of the swing"


@pytest.mark.parametrize("speed", [0.0, 1e-16, 5e-8])
def test_what_creeps_within_its_window_for_long_enough_rests(speed: float) -> None:
    """No speed is compared with nothing; what leaves the window moves, however slowly."""
    rest = Standstill(1e-6, 10)
    for k in range(12):
        assert not rest.rests or k == 11
        rest.look(1.0 + k * speed, 2.0)
    assert rest.rests
    rest.look(1.0 + 2e-6, 2.0)
    assert not rest.rests


@pytest.mark.parametrize(("off", "command"), [(5e-7, 1.0), (-5e-7, 1.0), (5e-6, 1.0 + 5e-6)])
def test_an_axis_that_rests_at_its_command_keeps_it(off: float, command: float) -> None:
    """To the bit: only one that was brought elsewhere takes that place for its command."""
    axis = new_axis(1.0)
    axis.position += off
    axis.rest()
    assert axis.command == command


def test_a_tracked_set_point_inside_the_limits_passes_unchanged() -> None:
    """The limiter is no filter: what keeps the limits is not delayed."""
    limiter = CommandLimiter(PARAMETERS, 0.0, DT)
    for k in range(1500):
        wanted = 0.5 * (1.0 - math.cos(4.0 * k * DT))
        limiter.step(wanted, 1.0)
        assert limiter.position == pytest.approx(wanted, abs=1e-12)


def test_speed_zero_stops_and_a_later_speed_catches_up() -> None:
    """Holding a stream is a ramp to standstill; letting go returns to the set point."""
    axis = new_axis()
    for k in range(200):
        axis.step(min(0.01 * k, 1.5), 1.0)
    for _ in range(200):
        axis.step(2.0, 0.0)
    assert axis.velocity == 0.0
    held = axis.position
    axis.step(2.0, 0.0)
    assert axis.position == held
    for _ in range(500):
        axis.step(2.0, 1.0)
    assert axis.position == pytest.approx(2.0, abs=1e-12)


def test_brakes_stop_faster_than_the_command_ramp_and_stay() -> None:
    """Without drives the axis decelerates by its brakes and keeps still, whatever was asked for."""
    axis = new_axis(-2.0)
    while axis.velocity < 7.0:
        axis.step(2.4, 1.0)
    start, speed = axis.position, axis.velocity
    for _ in range(200):
        axis.brake()
    assert axis.velocity == 0.0
    assert axis.position - start == pytest.approx(
        speed**2 / (2 * PARAMETERS.estop_deceleration), rel=0.02
    )
    stopped = axis.position
    axis.step(stopped, 1.0)
    assert axis.position == pytest.approx(stopped, abs=1e-6)


def test_encoder_counts_are_whole() -> None:
    """What a client reads is a multiple of one count, half a count from the truth at most."""
    axis = new_axis()
    for k in range(300):
        axis.step(0.001 * k, 1.0)
        counts = axis.measured_position / PARAMETERS.resolution
        assert counts == pytest.approx(round(counts), abs=1e-6)
        assert abs(axis.measured_position - axis.position) <= 0.5 * PARAMETERS.resolution * (
            1 + 1e-6
        )
        assert abs(
            axis.measured_velocity - axis.velocity
        ) <= 0.5 * PARAMETERS.resolution / 0.001 * (1 + 1e-6)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(("held", "percent"), [(None, 0.0), (Friction(3.0, 2.0, 0.5, 0.1), 3.0)])
def test_the_torque_is_what_moves_the_axis_and_what_holds_it_back(
    way: float, held: Friction | None, percent: float
) -> None:
    """At an even speed friction alone: (2 + 0.5 * 0.5) / 75; it takes no part at rest."""
    axis = Axis(msgspec.structs.replace(PARAMETERS, held=held), (5, 10), 0.0, DT, 2)
    pushes = []
    for k in range(500):
        axis.step(way * 0.5 * DT * k, 1.0)
        pushes.append(axis.torque_percent)
    assert pushes[0] == 0.0
    assert pushes[-1] == pytest.approx(way * percent, abs=1e-3)
    for _ in range(500):
        axis.step(0.0, 1.0)
    assert axis.torque_percent == pytest.approx(0.0, abs=1e-3)


def test_a_drive_that_gives_all_it_has_is_at_100_percent() -> None:
    """Of either sign: it speeds up, and brakes."""
    weak = msgspec.structs.replace(PARAMETERS, servo_acceleration=5.0)
    axis = Axis(weak, (5, 10), 0.0, DT, 2)
    pushes = []
    for _ in range(400):
        axis.step(1.0, 1.0)
        pushes.append(axis.torque_percent)
    assert (min(pushes), max(pushes)) == pytest.approx((-100.0, 100.0))


@pytest.mark.parametrize(("held", "drag"), [(None, 0.35), (Friction(30.0, 20.0, 0.0, 0.1), 20.0)])
def test_a_load_with_play_coasts_by_its_own_friction_when_the_motor_brakes(
    held: Friction | None, drag: float
) -> None:
    """To the other flank; without a friction of its own by a hundredth of the acceleration."""
    axis = Axis(msgspec.structs.replace(PARAMETERS, held=held, backlash=0.04), (5, 10), 0.0, DT, 2)
    behind, loads = [], []
    for k in range(400):
        axis.step(min(2.0 * DT * k, 1.0), 1.0)
        behind.append(axis.position - axis.joint_position)
        loads.append(axis.joint_position)
    pushed = next(k for k in range(400) if behind[k] == pytest.approx(0.02))
    leaves = next(k for k in range(pushed, 400) if behind[k] < 0.0199)
    slower = -np.diff(loads[leaves : leaves + 6], 2) / DT**2
    assert slower == pytest.approx(drag, rel=0.01)


def test_the_brake_takes_the_load_along_within_the_play_of_a_worn_gear() -> None:
    """The load stands when the motor has stood for a while, and nothing knocks with drives on."""
    play = 0.01
    axis = Axis(msgspec.structs.replace(PARAMETERS, backlash=play), (5, 10), -2.0, DT, 2)
    while axis.velocity < 5.0:
        axis.step(2.0, 1.0)
    begun = axis.position
    for _ in range(1000):
        if axis.brake():
            break
        assert abs(axis.position - axis.joint_position) <= 0.5 * play + 1e-9
    assert axis.brake() and axis.position - begun == pytest.approx(0.14, abs=0.01)
    stood = axis.joint_position
    for _ in range(10):
        axis.step(axis.position, 1.0)
        assert abs(axis.torque_percent) < 1.0
    assert axis.joint_position == stood


@pytest.mark.parametrize("joint_name", ["joint_1", "joint_2", "table_joint"])
def test_streamed_set_points_come_out_with_a_constant_lag(
    joint_name: str, config: EmulatorConfig, robot: Robot
) -> None:
    """An 80 % motion streamed at 100 Hz comes out to 0.05 deg, one constant lag aside."""
    joint = robot.joint(joint_name)
    axis = Axis(
        axis_parameters(config.plant, joint),
        config.plant.filter_lengths,
        -0.9,
        config.dt,
        config.plant.servo_substeps,
    )
    plan, wanted = ruckig.InputParameter(1), ruckig.Trajectory(1)
    plan.current_position, plan.target_position = [-0.9], [0.9]
    plan.max_velocity, plan.max_acceleration, plan.max_jerk = (
        [0.8 * joint.velocity],
        [joint.acceleration],
        [joint.jerk],
    )
    ruckig.Ruckig(1).calculate(plan, wanted)

    def at(t: float) -> float:
        return float(wanted.at_time(min(max(t, 0.0), wanted.duration))[0][0])

    times, rows, held, per_setpoint = [], [], -0.9, round(0.01 / config.dt)
    for k in range(round((wanted.duration + 0.3) / config.dt)):
        held = float(np.float32(at(k * config.dt))) if k % per_setpoint == 0 else held
        axis.step(held, 1.0)
        times.append((k + 1) * config.dt)
        rows.append(axis.position)
    lags = np.arange(0.015, 0.03, 0.0001)
    errors = [max(abs(at(t - lag) - q) for t, q in zip(times, rows)) for lag in lags]
    assert math.degrees(min(errors)) < 0.05
    assert 0.018 < lags[int(np.argmin(errors))] < 0.023


def test_random_streams_with_random_arrival_stay_in_range(
    config: EmulatorConfig, robot: Robot
) -> None:
    """Every shipped axis keeps its range under noise of the size of its range."""
    random_numbers = random.Random(3)
    for joint in robot.joints:
        parameters = axis_parameters(config.plant, joint)
        axis = Axis(
            parameters,
            config.plant.filter_lengths,
            parameters.upper,
            config.dt,
            config.plant.servo_substeps,
        )
        target = parameters.upper
        for _ in range(3000):
            if random_numbers.random() < 0.2:
                target = random_numbers.uniform(2 * parameters.lower, 2 * parameters.upper + 0.01)
            axis.step(target, 1.0)
            assert parameters.lower <= axis.position <= parameters.upper
