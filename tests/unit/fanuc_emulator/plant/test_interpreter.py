"""A stream without look-ahead: motion by motion, and later from motion to motion."""

from __future__ import annotations

import msgspec
import pytest
from fanuc_emulator.plant.config import StreamFile, load_plant
from fanuc_emulator.plant.interpreter import StreamInterpreter, interpreter_of
from harness.yaml_files import CONFIG
from scara_config import Robot

PERIOD = 0.008
FILE = StreamFile(False, lag_ms=24.0, lag_step_ms=8.0, lag_largest_ms=40.0, rest_s=240.0)


def interpreter(**changes: float) -> StreamInterpreter:
    """Return one of two joints that stand at 0, 1 rad/s at most."""
    made = StreamInterpreter(msgspec.structs.replace(FILE, **changes), (1.0, 1.0), PERIOD)
    made.reset((0.0, 0.0))
    return made


def test_a_set_point_begins_to_move_after_the_lag() -> None:
    """Three periods of 8 ms, then a motion of two periods at the greatest speed."""
    stream = interpreter()
    shown = [stream.step((0.016, 0.0), 1.0) for _ in range(6)]
    assert [q[0] for q in shown] == pytest.approx([0.0, 0.0, 0.0, 0.008, 0.016, 0.016])


def test_a_motion_of_whole_periods_takes_no_period_more_for_a_rounding() -> None:
    """Three times 0.1 is a little more than 0.3 to a computer."""
    stream = StreamInterpreter(msgspec.structs.replace(FILE, lag_ms=0.0), (1.0,), 0.1)
    stream.reset((0.0,))
    shown = [stream.step((3 * 0.1,), 1.0)[0] for _ in range(3)]
    assert shown == pytest.approx([0.1, 0.2, 0.3])


def test_the_joint_that_needs_longest_decides() -> None:
    """Both end together, on a straight line."""
    stream = interpreter(lag_ms=0.0)
    shown = [stream.step((0.032, -0.008), 1.0) for _ in range(4)]
    assert shown[1] == pytest.approx((0.016, -0.004))
    assert shown[3] == (0.032, -0.008)


def test_what_is_written_while_a_motion_is_planned_counts_for_the_next() -> None:
    """PR[1] is read once for each motion: no look-ahead, and no turning back half-way."""
    stream = interpreter(lag_ms=0.0)
    begun = stream.step((0.024, 0.0), 1.0)[0]
    shown = [stream.step((0.0, 0.0), 1.0)[0] for _ in range(4)]
    assert [begun, *shown] == pytest.approx([0.008, 0.016, 0.024, 0.016, 0.008])


def test_half_the_speed_takes_twice_as_long() -> None:
    """R[2] and the override count when a motion is planned."""
    stream = interpreter(lag_ms=0.0)
    shown = [stream.step((0.016, 0.0), 0.5)[0] for _ in range(4)]
    assert shown == pytest.approx([0.004, 0.008, 0.012, 0.016])


def test_each_motion_from_rest_comes_later_up_to_the_largest_lag() -> None:
    """24, 32, 40 and again 40 ms; set points of one motion do not count as motions."""
    stream, lags = interpreter(), []
    for motion in range(1, 5):
        for part in (1, 2, 3):
            stream.step((motion + 0.001 * part, 0.0), 1.0)
        for _ in range(200):
            stream.step(None, 1.0)
        lags.append(stream.lag)
    assert lags == pytest.approx([0.024, 0.032, 0.040, 0.040])


def test_a_long_rest_brings_the_first_lag_back() -> None:
    """After 240 s of standing."""
    stream = interpreter(rest_s=2.0)
    for target in (0.01, 0.02):
        stream.step((target, 0.0), 1.0)
        for _ in range(50):
            stream.step(None, 1.0)
    assert stream.lag == pytest.approx(0.032)
    for _ in range(round(2.0 / PERIOD)):
        stream.step(None, 1.0)
    stream.step((0.03, 0.0), 1.0)
    assert stream.lag == pytest.approx(0.024)


def test_a_hold_is_a_rest_too() -> None:
    """Nothing moves in it, and it may last for as long as any."""
    stream = interpreter(rest_s=2.0)
    for target in (0.01, 0.02):
        stream.step((target, 0.0), 1.0)
        for _ in range(50):
            stream.step((target, 0.0), 0.0)
    assert stream.lag == pytest.approx(0.032)
    for _ in range(round(2.0 / PERIOD)):
        stream.step((0.02, 0.0), 0.0)
    stream.step((0.03, 0.0), 1.0)
    assert stream.lag == pytest.approx(0.024)


def test_a_hold_forgets_what_was_planned() -> None:
    """Nothing that was read before it comes out after it."""
    stream = interpreter()
    for _ in range(3):
        stream.step((1.0, 0.0), 1.0)
    held = stream.step((1.0, 0.0), 0.0)
    assert held == (0.0, 0.0)
    assert [stream.step(None, 1.0) for _ in range(20)] == [held] * 20


def test_an_invalid_set_point_is_not_planned() -> None:
    """What was planned before it is carried out to its end."""
    stream = interpreter(lag_ms=0.0)
    stream.step((0.016, 0.0), 1.0)
    assert stream.step(None, 1.0)[0] == pytest.approx(0.016)
    assert stream.step(None, 1.0)[0] == pytest.approx(0.016)


def test_a_plant_without_look_ahead_has_one_by_its_own_figures(robot: Robot) -> None:
    """Period, lag and the joints' speeds; with look-ahead each set point counts at once."""
    plant = load_plant(robot, CONFIG, "field")
    stream, joints = interpreter_of(plant, robot.joints), robot.joints
    assert stream is not None and plant.interpolation_period_ms == 8
    begin = (0.0,) * len(joints)
    stream.reset(begin)
    shown = [stream.step((joints[0].velocity, *begin[1:]), 1.0)[0] for _ in range(140)]
    assert stream.lag == pytest.approx(1e-3 * plant.stream.lag_ms)
    assert shown[:5] == pytest.approx([0.0] * 3 + [0.008 * k * joints[0].velocity for k in (1, 2)])
    assert shown[126] < shown[127] == shown[128] == joints[0].velocity
    assert interpreter_of(load_plant(robot, CONFIG, "ideal"), joints) is None
