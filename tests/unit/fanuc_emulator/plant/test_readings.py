"""What the registers show of positions and clock, and signals that are shown late."""

from __future__ import annotations

import statistics

import msgspec
import numpy as np
import pytest
from fanuc_emulator.alarms import Alarm
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.plant.config import AnswerFile, Plant
from fanuc_emulator.plant.delays import AnswerTimes, LateSignals
from fanuc_emulator.plant.readings import Readings
from fanuc_emulator.uop import Outputs
from scara_config import Robot

from fanuc_emulator import alarms

DEG = 0.017453292519943295


def changed(plant: Plant, error_ms: int = 0, **measuring: object) -> Plant:
    """Return the ideal plant with other measuring."""
    return msgspec.structs.replace(
        plant,
        clock=msgspec.structs.replace(plant.clock, error_ms=error_ms),
        measuring=msgspec.structs.replace(plant.measuring, **measuring),
    )


def test_the_ideal_plant_shows_what_is_true(config: EmulatorConfig, robot: Robot) -> None:
    """The very values, each period."""
    readings = Readings(config.plant, robot.joints, np.random.default_rng(1))
    for tick in range(3):
        positions = (0.1 * tick,) * 5
        torques = (10.0 * tick,) * 5
        shown = positions, positions, 2 * tick, torques
        assert readings.read(tick, positions, positions, 2 * tick, torques) == shown


@pytest.mark.parametrize(
    ("phase_ms", "ticks"),
    [(0, [0, 0, 0, 0, 4, 4, 4, 4, 8, 8]), (6, [0, 0, 0, 3, 3, 3, 3, 7, 7, 7])],
)
def test_positions_and_clock_are_read_together_once_a_period(
    config: EmulatorConfig, robot: Robot, phase_ms: int, ticks: list[int]
) -> None:
    """Between two readings the registers stand; the first period may be shorter."""
    plant = changed(config.plant, period_ms=8, phase_ms=phase_ms)
    readings = Readings(plant, robot.joints, np.random.default_rng(1))
    shown = [readings.read(k, (float(k),) * 5, (0.0,) * 5, 2 * k) for k in range(10)]
    assert [reading.positions[0] for reading in shown] == ticks
    assert [reading.clock_ms for reading in shown] == [2 * tick for tick in ticks]


def test_noise_has_the_rms_of_the_file(config: EmulatorConfig, robot: Robot) -> None:
    """Gaussian, in each joint's unit; joint_3 is counted in mm."""
    plant = changed(config.plant, noise_deg=0.01, noise_mm=0.05)
    readings = Readings(plant, robot.joints, np.random.default_rng(1))
    rows = [readings.read(tick, (0.0,) * 5, (0.0,) * 5, 0).positions for tick in range(4000)]
    turns, strokes = [row[0] for row in rows], [row[2] for row in rows]
    assert statistics.pstdev(turns) == pytest.approx(0.01 * DEG, rel=0.05)
    assert statistics.pstdev(strokes) == pytest.approx(0.05e-3, rel=0.05)
    assert abs(statistics.mean(turns)) < 0.001 * DEG


def test_two_decimals_are_those_of_degrees_and_millimetres(
    config: EmulatorConfig, robot: Robot
) -> None:
    """As a controller prints them."""
    readings = Readings(changed(config.plant, decimals=2), robot.joints, np.random.default_rng(1))
    shown = readings.read(0, (1.234567 * DEG, 0.0, -0.1234567, 0.0, 0.0), (0.0,) * 5, 0).positions
    assert shown[0] == pytest.approx(1.23 * DEG, abs=1e-12)
    assert shown[2] == pytest.approx(-0.12346, abs=1e-12)


def test_the_clock_is_apart_by_the_error_at_most(config: EmulatorConfig, robot: Robot) -> None:
    """Either way, and every millisecond of it happens."""
    readings = Readings(changed(config.plant, error_ms=2), robot.joints, np.random.default_rng(1))
    errors = {readings.read(k, (0.0,) * 5, (0.0,) * 5, 2 * k).clock_ms - 2 * k for k in range(500)}
    assert errors == {-2, -1, 0, 1, 2}


@pytest.mark.parametrize("chance", [{"noise_mm": 0.1}, {"error_ms": 1}])
def test_what_is_left_to_chance_needs_a_generator(
    chance: dict[str, float], config: EmulatorConfig, robot: Robot
) -> None:
    """A plant with noise that shows none would be another plant."""
    with pytest.raises(ValueError, match="a generator has to draw them"):
        Readings(changed(config.plant, **chance), robot.joints, None)


def outputs(**changes: bool) -> Outputs:
    """Return outputs that are all off but for ``changes``."""
    return Outputs(**{**dict.fromkeys(Outputs.__struct_fields__, False), **changes})


def test_signals_arrive_apart() -> None:
    """Each after its own time, in both directions; what is not named at once."""
    late = LateSignals({"sysrdy": 4.0, "panel_estop": 8.0}, period_ms=2)
    raised = outputs(sysrdy=True, panel_estop=True, fault=True)
    assert late.step(outputs(), None)[0] == outputs()
    shown = [late.step(raised, None)[0] for _ in range(5)]
    assert [each.fault for each in shown] == [True] * 5
    assert [each.sysrdy for each in shown] == [False, False, True, True, True]
    assert [each.panel_estop for each in shown] == [False] * 4 + [True]
    fallen = [late.step(outputs(), None)[0] for _ in range(5)]
    assert [each.sysrdy for each in fallen] == [True, True, False, False, False]


def test_an_alarm_is_shown_late_too() -> None:
    """The register of the active alarm."""
    alarm = Alarm(alarms.NO_VACUUM, "a test", 0.0)
    late = LateSignals({"alarm": 4.0}, period_ms=2)
    late.step(outputs(), None)
    assert [late.step(outputs(), alarm)[1] for _ in range(4)] == [None, None, alarm, alarm]


def test_a_reset_is_shown_in_the_makers_order() -> None:
    """SYSRDY, then the end of the alarm, and CMDENBL, whatever is late by how much."""
    alarm = Alarm(alarms.IMSTP, "a test", 0.0)
    late = LateSignals({"sysrdy": 6.0, "cmdenbl": 2.0}, period_ms=2)
    late.step(outputs(fault=True), alarm)
    shown = [late.step(outputs(sysrdy=True, cmdenbl=True), None) for _ in range(5)]
    assert [each.sysrdy for each, _ in shown] == [False, False, False, True, True]
    assert [each.cmdenbl for each, _ in shown] == [False, False, False, True, True]
    assert [each.fault for each, _ in shown] == [True, True, True, False, False]
    assert [told for _, told in shown] == [alarm, alarm, alarm, None, None]


def test_answers_take_longer_while_a_program_runs() -> None:
    """Evenly drawn between the shortest and the longest."""
    answers = AnswerTimes(
        AnswerFile(idle_ms=(2.0, 4.0), running_ms=(4.0, 8.0)), np.random.default_rng(1)
    )
    idle = [answers.next(running=False) for _ in range(300)]
    running = [answers.next(running=True) for _ in range(300)]
    assert not answers.at_once
    assert 0.002 <= min(idle) < 0.0021 and 0.0039 < max(idle) <= 0.004
    assert 0.004 <= min(running) < 0.0042 and 0.0078 < max(running) <= 0.008
    assert AnswerTimes(AnswerFile((0.0, 0.0), (0.0, 0.0)), np.random.default_rng(1)).at_once
