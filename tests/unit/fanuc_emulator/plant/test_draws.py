"""Another robot of the same kind: drawn by a seed from what is filed."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest
from fanuc_emulator.plant.config import INTERPOLATIONS_MS, READINGS_MS, SPREAD, drawn, load_plant
from scara_config import ConfigError, load_robot
from scara_config.profile import plant_path

CONFIG = Path(__file__).resolve().parents[4] / "config"
ROBOT = load_robot(CONFIG)
FILED = load_plant(ROBOT, CONFIG, "field")
SEEDS = range(1, 25)
WHOLE = ("start_delay", "power_on")


def test_the_same_seed_gives_the_same_robot_and_another_seed_another() -> None:
    """On any machine: what was measured on a drawn robot can be repeated."""
    one, again, other = (load_plant(ROBOT, CONFIG, f"field:{seed}") for seed in (7, 7, 8))
    assert one == again != other
    assert "drawn by seed 7" in one.description


@pytest.mark.parametrize("filed", ["field", "ideal"])
def test_a_drawn_robot_is_a_plant_within_its_limits(filed: str) -> None:
    """What a file may hold: periods of the servo's, filters of whole steps, ranges in order."""
    names = ("natural_frequency_hz", "damping", "servo_acceleration_percent")
    base = load_plant(ROBOT, CONFIG, filed)
    readings, interpolations = set(), set()
    for seed in SEEDS:
        plant = load_plant(ROBOT, CONFIG, f"{filed}:{seed}")
        assert msgspec.convert(msgspec.to_builtins(plant), type(plant), strict=False) == plant
        for period, phase, (shortest, longest), found in (
            (plant.measuring.period_ms, plant.measuring.phase_ms, READINGS_MS, readings),
            (
                plant.interpolation_period_ms,
                plant.interpolation_phase_ms,
                INTERPOLATIONS_MS,
                interpolations,
            ),
        ):
            assert shortest <= period <= longest and 0 <= phase < period
            assert not period % plant.servo_period_ms and not phase % plant.servo_period_ms
            found.add(period)
        for joint, axis in plant.axes.items():
            for name in names:
                ratio = getattr(axis, name) / getattr(base.axes[joint], name)
                assert 1.0 - SPREAD <= ratio <= 1.0 + SPREAD
        assert plant.geometry == base.geometry and plant.payload_kg == base.payload_kg
    assert len(readings) >= 5 and len(interpolations) >= 4


@pytest.mark.parametrize("servo_ms", [1, 2])
def test_a_drawn_robot_has_any_period_of_its_family_and_any_phase_of_that(servo_ms: int) -> None:
    """Readings each 4 to 16 ms, interpolation each 4 to 12, in whole periods of the servo."""
    filed = msgspec.structs.replace(FILED, servo_period_ms=servo_ms)
    plants = [drawn(filed, seed) for seed in range(400)]
    readings = {(p.measuring.period_ms, p.measuring.phase_ms) for p in plants}
    steps = {(p.interpolation_period_ms, p.interpolation_phase_ms) for p in plants}
    for found, longest in ((readings, 16), (steps, 12)):
        assert {period for period, _ in found} == set(range(4, longest + 1, servo_ms))
        for period in range(4, longest + 1, 2):
            phases = {phase for each, phase in found if each == period}
            assert phases <= set(range(0, period, servo_ms))
            assert servo_ms == 1 or phases == set(range(0, period, 2))


def numbers_of(plant: object, path: str = "") -> dict[str, float]:
    """Return all numbers of a plant by their places in its file."""
    parts = plant.items() if isinstance(plant, dict) else enumerate(plant)
    found = {}
    for key, value in parts:
        if isinstance(value, (dict, list)):
            found |= numbers_of(value, f"{path}{key}.")
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            found[f"{path}{key}"] = value
    return found


def test_each_number_is_drawn_near_what_is_filed_or_stays() -> None:
    """Within the spread, to both sides of it; filters in steps of 10 ms, times in whole ones."""
    filed, ratios = numbers_of(msgspec.to_builtins(FILED)), dict[str, set[float]]()
    stays = r"^(clock|payload_kg|geometry|shown|servo_|fine|axes\.\w+\.(encoder|travel|zero|estop))"
    for seed in SEEDS:
        plant = load_plant(ROBOT, CONFIG, f"field:{seed}")
        for key, value in numbers_of(msgspec.to_builtins(plant)).items():
            if filed[key] and not re.search("interpolation|measuring.*period|phase", key):
                ratios.setdefault(key, set()).add(value / filed[key])
                rough = 5.0 if key.startswith("filter_ms") else 0.5 * key.startswith(WHOLE)
                assert abs(value - filed[key]) <= SPREAD * abs(filed[key]) + rough + 1e-9, key
    for key, seen in ratios.items():
        if re.search(stays, key):
            assert seen == {1.0}, key
        elif not key.endswith("feedforward"):
            assert min(seen) < 0.85 and max(seen) > 1.15, key


def test_a_draw_that_is_no_number_is_refused() -> None:
    """Before anything starts, as a plant that does not exist is."""
    assert plant_path(CONFIG, "field:3") == plant_path(CONFIG, "field")
    for name, said in (("field:x", "a draw is a whole number"), ("fild:3", "field")):
        with pytest.raises(ConfigError, match=said):
            plant_path(CONFIG, name)
