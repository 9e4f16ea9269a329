"""How a plant wears, and what its motor torques and joints show of it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from fanuc_emulator.drives.backlash import KNOCK_S, MOTOR_SHARE, Backlash
from fanuc_emulator.plant.config import Plant, load_plant
from fanuc_emulator.plant.wear import WARM_C, Wear, at_temperature, vacuum_s, worn
from scara_config import load_robot

FOLDER = Path(__file__).resolve().parents[4] / "config" / "robots" / "fanuc_sr6ia"
ROBOT = load_robot(FOLDER)
FIELD: Plant = load_plant(ROBOT, FOLDER, "field")


def test_friction_grows_in_one_joint_and_most_at_low_speed() -> None:
    """Twice Coulomb's part, less of the viscous one; the other joints are as they were."""
    plant = worn(FIELD, Wear("friction", 1.0, "joint_2"))
    before, after = FIELD.axes["joint_2"].held_friction, plant.axes["joint_2"].held_friction
    assert before is not None and after is not None
    assert after.coulomb_percent == pytest.approx(2.0 * before.coulomb_percent)
    assert before.viscous_percent < after.viscous_percent < 2.0 * before.viscous_percent
    assert plant.axes["joint_1"] == FIELD.axes["joint_1"]


def test_a_cold_gear_rubs_more_and_a_warm_one_as_filed() -> None:
    """Within 30 % for 12 degrees either way."""
    assert at_temperature(FIELD, WARM_C) == FIELD
    filed = FIELD.axes["joint_1"].held_friction
    for celsius, sign in ((WARM_C - 12.0, 1.0), (WARM_C + 12.0, -1.0)):
        found = at_temperature(FIELD, celsius).axes["joint_1"].held_friction
        assert found is not None and filed is not None
        assert 0.0 < sign * (found.viscous_percent / filed.viscous_percent - 1.0) <= 0.31


def test_what_else_wears() -> None:
    """A soft loop keeps its damping force; a payload adds inertia to each joint that carries it."""
    soft, filed = worn(FIELD, Wear("stiffness", 0.36, "joint_1")).axes["joint_1"], FIELD.axes
    assert soft.natural_frequency_hz == pytest.approx(0.8 * filed["joint_1"].natural_frequency_hz)
    force = filed["joint_1"].damping * filed["joint_1"].natural_frequency_hz
    assert soft.damping * soft.natural_frequency_hz == pytest.approx(force)
    heavy = worn(FIELD, Wear("payload", 1.0))
    assert heavy.payload_kg == pytest.approx(FIELD.payload_kg + 1.0)
    assert heavy.axes["joint_1"].payload_inertia_percent == pytest.approx(45.0)
    assert heavy.axes["table_joint"].payload_inertia_percent == 0.0
    before, after = filed["joint_1"].held_friction, heavy.axes["joint_1"].held_friction
    share = heavy.payload_kg / FIELD.payload_kg
    assert before is not None and after is not None and before.load_percent > 0.0
    assert after.load_percent == pytest.approx(share * before.load_percent)


def test_nothing_tells_what_a_payload_does_to_a_plant_without_one() -> None:
    """The ideal robot's tool is empty."""
    with pytest.raises(ValueError, match=r"payload_kg = 0: 1.5 kg more need a plant with"):
        worn(load_plant(ROBOT, FOLDER, "ideal"), Wear("payload", 1.5))


@pytest.mark.parametrize(("leak", "longer"), [(0.0, 1.0), (0.2, 1.51), (0.4, math.inf)])
def test_a_leak_makes_the_vacuum_late_and_at_last_impossible(leak: float, longer: float) -> None:
    """As the law of a pump that draws through a hole says."""
    plant = worn(FIELD, Wear("vacuum", leak))
    assert vacuum_s(plant, 0.04) == pytest.approx(0.04 * longer, rel=0.01)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_load_with_play_starts_later_than_its_motor_and_less_torque_moves_it_meanwhile(
    way: float,
) -> None:
    """Then the flanks meet with a knock, and the load stays behind by half of the play."""
    gap, h, a = Backlash(0.01, 0.1, 0.0), 0.001, way * 10.0
    position = velocity = 0.0
    free = pushes = 0.0
    for _ in range(60):
        velocity += a * h
        position += velocity * h
        gap.step(position, velocity, a, h)
        assert abs(position - gap.load) <= 0.005 + 1e-12
        free += gap.pushes(a) == pytest.approx(MOTOR_SHARE * a)
        pushes = max(pushes, way * gap.pushes(a))
    assert 25 <= free <= 40, "half of the play takes sqrt(2 * 0.005 / 10) = 32 ms"
    assert pushes > 2.0 * abs(a) and gap.load == pytest.approx(position - way * 0.005)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_load_coasts_through_its_play_where_its_motor_brakes(way: float) -> None:
    """From the flank that pushed it to the one that brakes it; friction brakes it a little."""
    gap, h = Backlash(0.01, 0.1, 0.0), 0.001
    position = velocity = 0.0
    coasts = []
    for a in [way * 10.0] * 100 + [way * -10.0] * 60:
        velocity += a * h
        position += velocity * h
        gap.step(position, velocity, a, h)
        coasts.append(gap.pushes(a) == pytest.approx(MOTOR_SHARE * a))
    assert 43 <= sum(coasts[100:]) <= 47, "the play takes sqrt(2 * 0.01 / (10 - 0.1)) = 45 ms"
    assert gap.load == pytest.approx(position + way * 0.005)


@pytest.mark.parametrize("velocity", [0.5, 1.0, -1.0])
def test_the_knock_grows_with_the_speed_at_which_the_flanks_meet(velocity: float) -> None:
    """It brings the load, which stands, to the motor's speed."""
    gap = Backlash(0.01, 0.0, 0.0)
    gap.step(math.copysign(0.006, velocity), velocity, 0.0, 0.001)
    assert gap.pushes(0.0) == pytest.approx((1.0 - MOTOR_SHARE) * velocity / KNOCK_S)
