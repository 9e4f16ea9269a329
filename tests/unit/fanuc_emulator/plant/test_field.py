"""The shipped field plants do what their files say of them."""

from __future__ import annotations

import random
import re
from pathlib import Path

import msgspec
import numpy as np
import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.axis import Axis, AxisParameters, Friction
from fanuc_emulator.snapshot import ControlType
from fanuc_emulator.tp.executor import ProgramState
from harness.programs import steps_of
from harness.running.thorough import thorough
from scara_config import load_robot
from scara_config.profile import CHOICE, known_robots

CONFIG = Path(__file__).resolve().parents[4] / "config"
MOTIONS, MOTION_S = 14, 1.6
"""Each motion takes a second, the rest is more than the largest lag."""
COUNTS = 3e-6
"""Some counts of an encoder [rad or m]."""
SWING = 0.3
"""How far joint_1 goes to and fro [rad]."""


DAY = ("fanuc_sr6ia", "articulated_six")
ROBOTS = [k if k in DAY else thorough(k)[0] for k in known_robots(CONFIG)]
"""By day one SCARA, and the arm."""


@pytest.fixture(params=ROBOTS)
def field(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Controller:
    """Give the field plant of each robot, at 100 % override."""
    monkeypatch.setenv(CHOICE, request.param)
    robot = load_robot(CONFIG)
    made = Controller(
        load_emulator(robot, CONFIG, "field"), robot, {}, 0.0, random=np.random.default_rng(1)
    )
    made.write_override(100)
    return made


def begin_stream(robot: Controller) -> np.ndarray:
    """Start the stream program where the robot stands; return that pose."""
    home = np.array(robot.step().measured_positions)
    robot.write_setpoint(home)
    robot.write_setpoint_valid(True)
    robot.write_input("rsr1", True)
    for _ in range(50):
        now = robot.step()
    robot.write_input("rsr1", False)
    assert now.control_type is ControlType.STREAM
    return home


def smooth(part: float) -> float:
    """Return a rest-to-rest curve from 0 to 1."""
    x = min(part, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def lag_of(wanted: np.ndarray, made: np.ndarray, dt: float) -> float:
    """Return the shift in which two curves are nearest [s]: by least squares, sample by sample."""
    made = made - made[-1] + wanted[-1]
    errors = [np.mean((made[n:] - wanted[: len(wanted) - n]) ** 2) for n in range(150)]
    return float(np.argmin(errors)) * dt


def test_the_lag_of_a_stream_is_what_the_description_says(field: Controller) -> None:
    """The first motion has the smallest, and it grows to the largest; measured at joint_1."""
    plant = field._config.plant
    low, high = map(float, re.findall(r"(\d+) to (\d+) ms of lag", plant.description)[0])
    home, lags = begin_stream(field), []
    for motion in range(MOTIONS):
        wanted, made = [], []
        for tick in range(round(MOTION_S / plant.dt)):
            swing = smooth(tick * plant.dt) if motion % 2 == 0 else 1.0 - smooth(tick * plant.dt)
            q = home.copy()
            q[0] += SWING * swing
            if tick % 5 == 0:
                field.write_setpoint(q)
            wanted.append(q[0])
            made.append(field.step().positions[0])
        lags.append(1e3 * lag_of(np.array(wanted), np.array(made), plant.dt))
    assert lags[0] == pytest.approx(low, abs=4.0)
    assert lags[-1] == pytest.approx(high, abs=4.0)
    assert np.all(np.diff(lags) >= 0.0)


def test_a_hold_stops_a_stream_at_once(field: Controller) -> None:
    """What the interpreter has planned does not come out after it: the ramp, and no lag."""
    home, dt = begin_stream(field), field._config.dt
    speed = 0.2 * load_robot(CONFIG).joints[0].velocity
    for tick in range(round(0.6 / dt)):
        q = home.copy()
        q[0] += speed * tick * dt * (1.0 if home[0] <= 0.0 else -1.0)
        field.write_setpoint(q)
        now = field.step()
    assert abs(now.velocities[0]) == pytest.approx(speed, rel=0.05)
    field.write_input("hold", False)
    ramp = speed / (1.3 * load_robot(CONFIG).joints[0].acceleration)
    for _ in range(round((ramp + 0.06) / dt)):
        now = field.step()
    assert now.program_state is ProgramState.PAUSED
    assert abs(now.velocities[0]) < 0.02 * speed


def test_an_emergency_stop_and_its_reset_are_shown_in_the_makers_order(field: Controller) -> None:
    """FAULT first, then the drives; back again SYSRDY first, and FAULT goes with it."""
    for level in (False, True):
        field.write_input("imstp", level)
        shown = [field.step() for _ in range(300)]
    assert shown[-1].outputs.fault and not shown[-1].outputs.sysrdy
    field.pulse_input("fault_reset")
    shown += [field.step() for _ in range(1000)]
    for now in shown:
        assert now.outputs.fault or now.outputs.sysrdy
        assert now.outputs.sysrdy or not now.outputs.cmdenbl
        assert now.outputs.fault or now.alarm is None
    assert now.outputs.sysrdy and now.outputs.cmdenbl and not now.outputs.fault


def test_a_stream_goes_straight_at_the_override_times_its_own_speed(field: Controller) -> None:
    """R[2] of 50 % at an override of 50 %: a quarter, and no joint is there before the others."""
    home, velocity = begin_stream(field), load_robot(CONFIG).joints[0].velocity
    field.source.speed_percent = 50
    field.write_override(50)
    begin = np.array(field._motion.commands)
    end = begin + [0.5, 0.1, *[0.0] * (len(home) - 2)]
    field.write_setpoint(end)
    rows = np.array([field.step() and field._motion.commands for _ in range(800)])
    gone = (rows - begin)[:, :2]
    assert np.abs(gone[:, 0] - 5.0 * gone[:, 1]).max() < 1e-3
    assert rows[-1] == pytest.approx(end, abs=1e-6)
    fastest = np.abs(np.diff(gone[:, 0])).max() / field._config.dt
    assert fastest == pytest.approx(0.25 * velocity, rel=0.02)


def test_truth_and_encoders_are_apart_by_the_zero_offset(field: Controller) -> None:
    """At rest they differ by that, by noise and by half a count."""
    joints, axes = load_robot(CONFIG).joints, field._config.plant.axes
    now = field.step()
    for k, joint in enumerate(joints):
        offset = getattr(axes[joint.name], f"zero_offset_{joint.unit}") * joint.scale
        noise = getattr(field._config.plant.measuring, f"noise_{joint.unit}") * joint.scale
        assert offset != 0.0
        apart = now.positions[k] - now.measured_positions[k]
        assert apart == pytest.approx(offset, abs=5.0 * noise + 1e-6)


def test_a_program_ends_within_a_window_and_does_not_snap(monkeypatch: pytest.MonkeyPatch) -> None:
    """FINE is kept by the tolerance; friction holds the joints a little beside their targets."""
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")
    robot = load_robot(CONFIG)
    config, programs = load_emulator(robot, CONFIG, "field"), load_programs(robot, CONFIG)
    controller = Controller(config, robot, programs, 0.0, random=np.random.default_rng(1))
    controller.write_override(100)
    controller.write_input("rsr2", True)
    ended = None
    for _ in range(round(60.0 / config.dt)):
        now = controller.step()
        if ended is None and now.program_state is ProgramState.ABORTED and now.tick > 100:
            ended = now.tick
        if ended is not None and now.tick > ended + 500:
            break
    assert ended is not None
    steps = steps_of(programs[2])
    target = steps[-1]
    while not hasattr(target, "target"):
        target = steps[steps.index(target) - 1]
    left = [abs(axis.position - q) for axis, q in zip(controller._motion.axes, target.target)]
    assert not any(now.velocities)
    assert 0.0 < max(left[:2]) < config.plant.fine_tolerance_deg * robot.joints[0].scale


RUBBING = AxisParameters(
    lower=-10.0,
    upper=10.0,
    velocity=5.0,
    program_acceleration=10.0,
    command_acceleration=20.0,
    servo_acceleration=40.0,
    estop_deceleration=50.0,
    natural_frequency=100.0,
    damping=0.8,
    velocity_feedforward=0.6,
    resolution=1e-6,
    tolerance=1e-3,
    friction=Friction(static=2.0, coulomb=1.0, viscous=0.5, stribeck=0.1),
)


def test_friction_has_the_shape_of_stribecks_curve() -> None:
    """Largest at rest, smallest a little above, then growing with speed."""
    friction = RUBBING.friction
    assert friction is not None
    assert friction.at(0.0) == 2.0
    assert friction.at(0.1) == pytest.approx(1.0 + 1.0 / np.e + 0.05)
    assert friction.at(0.3) < friction.at(0.1) < friction.at(0.0)
    assert friction.at(5.0) == pytest.approx(3.5)


def test_a_step_below_what_friction_holds_moves_nothing() -> None:
    """The drive's acceleration is stiffness times error: 2 / 100^2 = 0.2 mrad are held."""
    parameters = msgspec.structs.replace(RUBBING, velocity_feedforward=0.0)
    for step, moves in ((1.9e-4, False), (2.5e-4, True)):
        axis = Axis(parameters, (5,), 0.0, 0.002, 2)
        for _ in range(500):
            axis.step(step, 1.0)
        assert (axis.position != 0.0) is moves
        assert axis.velocity == 0.0
        assert axis.resting


def test_a_moving_axis_lags_by_what_friction_takes() -> None:
    """At 1 rad/s: friction over stiffness, beside the lag that velocity feed-forward leaves."""
    lags = []
    for parameters in (RUBBING, msgspec.structs.replace(RUBBING, friction=None)):
        axis = Axis(parameters, (5,), 0.0, 0.002, 2)
        for tick in range(500):
            axis.step(0.002 * (tick + 1), 1.0)
        lags.append(axis.command - axis.position)
    friction = RUBBING.friction
    assert friction is not None
    assert lags[0] - lags[1] == pytest.approx(friction.at(1.0) / 100.0**2, rel=0.02)


@pytest.mark.parametrize("seed", [*range(3), *thorough(*range(3, 8))])
@pytest.mark.parametrize("name", ["fanuc_sr6ia", "articulated_six"])
def test_an_abort_ends_whatever_the_servos_are_like(name: str, seed: int) -> None:
    """Each axis is damped 0.7 to 1.3 times as much: a motor that creeps for ever does not move."""
    draw = random.Random(seed)
    robot = load_robot(CONFIG / "robots" / name)
    config = load_emulator(robot, CONFIG / "robots" / name, "field", settings="")
    axes = {
        name: msgspec.structs.replace(axis, damping=draw.uniform(0.7, 1.3) * axis.damping)
        for name, axis in config.plant.axes.items()
    }
    plant = msgspec.structs.replace(config.plant, axes=axes)
    made = Controller(
        msgspec.structs.replace(config, plant=plant),
        robot,
        load_programs(robot, CONFIG / "robots" / name),
        0.0,
        random=np.random.default_rng(seed),
    )
    made.write_override(100)
    made.write_input("panel_run2", True)
    for _ in range(draw.randrange(200, 800)):
        made.step()
    made.write_input("cstopi", True)
    shown = [made.step() for _ in range(400)]
    ended = next(k for k, each in enumerate(shown) if each.program_state is ProgramState.ABORTED)
    there, later = shown[ended].positions, shown[-1].positions
    assert later == pytest.approx(there, abs=COUNTS), "it had ended its way"
