"""The plants: each robot has both, and what is wrong in one is refused by file, key and value."""

from __future__ import annotations

import math
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import msgspec
import pytest
from fanuc_emulator.config import load_emulator
from fanuc_emulator.plant.config import Plant, axis_parameters, load_plant
from harness.yaml_files import REMOVED, changed_yaml, copy_configuration, shipped
from scara_config import ConfigError, Robot, load_robot
from scara_config.profile import CHOICE, PLANT_CHOICE, known_robots

CONFIG = Path(__file__).resolve().parents[4] / "config"


@pytest.mark.parametrize("plant", ["ideal", "field"])
@pytest.mark.parametrize("robot_name", known_robots(CONFIG))
def test_each_robot_has_both_plants(
    robot_name: str, plant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They load for its joints."""
    monkeypatch.setenv(CHOICE, robot_name)
    robot = load_robot(CONFIG)
    assert set(load_plant(robot, CONFIG, plant).axes) == {joint.name for joint in robot.joints}


def test_the_field_plants_differ_from_robot_to_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """One number for all would be tuned to, not coped with."""
    plants = []
    for name in known_robots(CONFIG):
        monkeypatch.setenv(CHOICE, name)
        plants.append(load_plant(load_robot(CONFIG), CONFIG, "field"))
    lags = [(plant.stream.lag_ms, plant.axes["joint_1"].natural_frequency_hz) for plant in plants]
    assert len(set(lags)) == len(lags) == 5


def test_what_a_plant_does_not_name_its_axes_do_not_have(robot: Robot) -> None:
    """No payload, no friction, no encoder that is off."""
    for axis in load_plant(robot, CONFIG, "ideal").axes.values():
        assert (axis.payload_inertia_percent, axis.friction) == (0.0, None)
        assert axis.zero_offset_deg == axis.zero_offset_mm == 0.0


@pytest.mark.parametrize("name", ["joint_2", "joint_3"])
def test_an_axis_is_what_its_figures_say(name: str) -> None:
    """Percent of robot.yaml's acceleration; the drive moves the payload too; turns to SI."""
    robot = load_robot(CONFIG)
    plant, joint = load_plant(robot, CONFIG, "field"), robot.joint(name)
    axis = msgspec.structs.replace(plant.axes[name], backlash_turns=0.125)
    made = axis_parameters(msgspec.structs.replace(plant, axes={name: axis}), joint)
    rubs, friction, percent = axis.friction, made.friction, 0.01 * joint.acceleration
    assert rubs is not None and friction is not None
    inertia = 1.0 + 0.01 * axis.payload_inertia_percent
    assert inertia > 1.2
    drive = percent / inertia
    travel = {"joint_2": math.radians(7.2), "joint_3": 0.02}[name]
    window = {"joint_2": math.radians(0.01), "joint_3": 2e-5}[name]
    for found, wanted in (
        ((made.lower, made.upper, made.velocity), (joint.lower, joint.upper, joint.velocity)),
        (made.program_acceleration, axis.program_acceleration_percent * percent),
        (made.command_acceleration, axis.command_acceleration_percent * percent),
        (made.servo_acceleration, axis.servo_acceleration_percent * drive),
        (made.estop_deceleration, axis.estop_deceleration_percent * drive),
        (made.natural_frequency**2 * inertia, (math.tau * axis.natural_frequency_hz) ** 2),
        ((made.damping, made.velocity_feedforward), (axis.damping, axis.velocity_feedforward)),
        ((made.resolution, made.tolerance), (travel / 2**17, window)),
        (made.backlash, travel / 8),
        (friction.static, (rubs.static_percent + rubs.load_percent) * drive),
        (friction.coulomb, (rubs.coulomb_percent + rubs.load_percent) * drive),
        (friction.viscous * joint.velocity, rubs.viscous_percent * drive),
        (friction.stribeck, 0.01 * rubs.stribeck_percent * joint.velocity),
    ):
        assert found == pytest.approx(wanted)


def test_a_plant_is_chosen_by_name_or_by_the_environment(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A name beats SCARA_PLANT, and without both it is the ideal one."""
    monkeypatch.delenv(PLANT_CHOICE, raising=False)
    ideal = load_plant(robot, CONFIG, "ideal")
    assert load_plant(robot, CONFIG) == ideal == load_emulator(robot, CONFIG).plant
    monkeypatch.setenv(PLANT_CHOICE, "field")
    field = load_plant(robot, CONFIG)
    assert field != ideal
    assert load_plant(robot, CONFIG, "ideal") == ideal
    assert load_emulator(robot, CONFIG).plant == field


def test_an_unknown_plant_is_refused_with_those_that_exist(robot: Robot) -> None:
    """A typing error starts nothing."""
    with pytest.raises(ConfigError, match=r"unknown plant 'feild': .*plants has field, ideal"):
        load_plant(robot, CONFIG, "feild")


BOUNDS = {
    "clock.boot_offset_ms": (0, 2**31 - 1),
    "clock.drift_ppm": (-500.0, 500.0),
    "clock.error_ms": (0, 20),
    "servo_period_ms": (1, 2),
    "servo_substeps": (1, 16),
    "interpolation_period_ms": (1, 40),
    "interpolation_phase_ms": (0, 40),
    "filter_ms.0": (10, 500),
    "start_delay_ms": (0, 1000),
    "power_on_ms": (0, 2000),
    "measuring.period_ms": (1, 40),
    "measuring.decimals": (0, 6),
    "measuring.noise_deg": (0.0, 1.0),
    "measuring.noise_mm": (0.0, 1.0),
    "measuring.phase_ms": (0, 40),
    "stream.rest_s": (0.0, 3600.0),
    "payload_kg": (0.0, 1000.0),
    "axes.joint_1.natural_frequency_hz": (0.1, 100.0),
    "axes.joint_1.damping": (0.1, 5.0),
    "axes.joint_1.velocity_feedforward": (0.0, 1.0),
    "axes.joint_1.encoder_counts_per_turn": (1, 2**26),
    "axes.joint_1.payload_inertia_percent": (0.0, 1000.0),
    "axes.joint_1.zero_offset_deg": (-1.0, 1.0),
    "axes.joint_1.zero_offset_mm": (-1.0, 1.0),
}
"""What can be a robot, by the places in a plant's file."""


@pytest.mark.parametrize("place", BOUNDS)
def test_a_figure_that_no_robot_has_is_refused(robot: Robot, place: str) -> None:
    """The least and the largest are taken, what lies beyond is not."""
    filed, (low, high) = load_plant(robot, CONFIG, "field"), BOUNDS[place]
    step = 1 if isinstance(low, int) else 0.2

    def with_figure(value: float) -> Plant:
        fields: Any = msgspec.to_builtins(filed)
        *path, last = [int(word) if word.isdigit() else word for word in place.split(".")]
        reduce(getitem, path, fields)[last] = value
        return msgspec.convert(fields, Plant, strict=False)

    for value in (low, high):
        assert with_figure(value)
    for value in (low - step, high + step):
        with pytest.raises(msgspec.ValidationError, match=place.removesuffix(".0").split(".")[-1]):
            with_figure(value)


@pytest.mark.parametrize(
    "place",
    [[], ["clock"], ["answers"], ["measuring"], ["stream"], ["axes", "joint_1"]]
    + [["geometry"], ["axes", "joint_1", "friction"]],
)
def test_a_key_that_nobody_knows_is_refused_wherever_it_stands(
    tmp_path: Path, robot: Robot, place: list[str | int]
) -> None:
    """A typing error changes nothing in silence."""
    copy_configuration(tmp_path)
    changed_yaml(shipped("plants/field.yaml"), tmp_path / "plants", [*place, "strange"], 1)
    with pytest.raises(ConfigError, match=r"plants/field.yaml: .*strange"):
        load_plant(robot, tmp_path, "field")


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["axes", "joint_9"], {}, r"axes.joint_9 = .*missing required field|joint_9.*no joint"),
        (["axes", "joint_2"], REMOVED, r"axes.joint_2: is missing"),
        (["axes", "joint_1", "damping"], -1.0, r"axes.joint_1.damping = -1.0: Expected"),
        (
            ["axes", "joint_3", "travel_per_turn_mm"],
            REMOVED,
            r"axes.joint_3: needs travel_per_turn_mm and not travel_per_turn_deg",
        ),
        (
            ["axes", "joint_3", "zero_offset_deg"],
            0.1,
            r"axes.joint_3.zero_offset_deg: joint_3 is counted in mm",
        ),
        (["filter_ms"], [15], r"filter_ms.*multiple"),
        (["servo_period_ms"], 5, r"servo_period_ms = 5: Expected `int` <= 2"),
        (
            ["interpolation_period_ms"],
            7,
            r"interpolation_period_ms = 7: must be a multiple of servo_period_ms = 2",
        ),
        (["measuring", "period_ms"], 5, r"measuring.period_ms = 5: must be a multiple of"),
        (["answers", "idle_ms"], [8, 2], r"answers.idle_ms = 8: must not be above the largest, 2"),
        (["stream", "lag_ms"], 500, r"stream.lag_ms = 500: must not be above the largest"),
        (
            ["shown_after_ms"],
            {"busi": 20},
            r"shown_after_ms.busi: unknown, allowed are cmdenbl, .*, alarm",
        ),
        (
            ["geometry"],
            {"screw_axes": {"joint_7": [0] * 6}, "home_pose": [[0] * 4] * 4},
            r"geometry.screw_axes.joint_7: is no joint of robot.yaml",
        ),
    ],
)
def test_a_wrong_plant_is_refused(
    tmp_path: Path, robot: Robot, path: list[str | int], value: Any, text: str
) -> None:
    """The text names file, key, value and what is allowed."""
    copy_configuration(tmp_path)
    changed_yaml(shipped("plants/ideal.yaml"), tmp_path / "plants", path, value)
    with pytest.raises(ConfigError, match=rf"plants/ideal.yaml: {text}"):
        load_plant(robot, tmp_path, "ideal")
