"""How a plant wears, and what its motor torques and joints show of it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from fanuc_emulator.drives.backlash import KNOCK_S, MOTOR_SHARE, Backlash
from fanuc_emulator.plant.config import AxisFile, FrictionFile, Plant, load_plant
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


def ratios(before: AxisFile, after: AxisFile) -> list[list[float]]:
    """Return how each number of each friction has grown, in the order of the file."""
    return [
        [getattr(new, key) / getattr(old, key) for key in FrictionFile.__struct_fields__]
        for old, new in (
            (before.friction, after.friction),
            (before.held_friction, after.held_friction),
        )
        if old is not None and new is not None
    ]


@pytest.mark.parametrize(
    ("plant", "grown"),
    [
        (worn(FIELD, Wear("friction", 0.5, "joint_1")), (1.5, 1.5, 1.2, 1.15, 1.5)),
        (at_temperature(FIELD, 20.0), (1.06, 1.06, 1.246, 1.0, 1.06)),
        (at_temperature(FIELD, 40.0), (0.94, 0.94, 0.803, 1.0, 0.94)),
    ],
)
def test_each_part_of_friction_grows_by_a_law_of_its_own(
    plant: Plant, grown: tuple[float, ...]
) -> None:
    """Static, Coulomb's, viscous, the speed of Stribeck, the load's; as the article has them."""
    found = ratios(FIELD.axes["joint_1"], plant.axes["joint_1"])
    assert len(found) == 2
    for each in found:
        assert each == pytest.approx(grown, rel=1e-3)


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


H = 0.001
"""A servo step [s]."""


def pushed(way: float, drag: float) -> Backlash:
    """Return a play of 10 mrad whose load the motor pushes one way at 0.5 rad/s."""
    gap = Backlash(0.01, drag, 0.0)
    gap.step(way * 0.005, way * 0.5, 0.0, H)
    assert gap.load == 0.0
    return gap


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("velocity", "acceleration", "follows"),
    [
        (0.5, -0.9, True),
        (0.5, -1.1, False),
        (-0.5, 1.1, True),
        (-0.5, 0.9, False),
        (0.0, 0.1, True),
        (0.0, -0.1, False),
    ],
)
def test_a_load_leaves_its_flank_when_the_motor_brakes_more_than_its_friction(
    way: float, velocity: float, acceleration: float, follows: bool
) -> None:
    """A flank can push and cannot pull; at rest there is no friction."""
    gap = pushed(way, 1.0)
    gap.step(way * 0.004, way * velocity, way * acceleration, H)
    assert (gap.load == pytest.approx(-way * 0.001)) is follows
    assert (gap.pushes(way) - gap.pushes(0.0) == pytest.approx(way)) is follows


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_flanks_that_meet_knock_by_the_difference_of_their_speeds(way: float) -> None:
    """The load coasts to the other one, is with the motor at once, and soon the knock is over."""
    gap = pushed(way, 0.0)
    for _ in range(3):
        gap.step(way * 0.005, 0.0, -way * 100.0, 5.0 * H)
    assert gap.load == pytest.approx(way * 0.0075)
    gap.step(way * 0.002, way * 0.2, -way, 0.0)
    assert gap.load == pytest.approx(way * 0.007)
    knock = gap.pushes(0.0)
    assert knock == pytest.approx(way * 0.6 * (0.2 - 0.5) / KNOCK_S)
    gap.step(way * 0.002, 0.0, -way, H)
    assert gap.pushes(0.0) == pytest.approx(knock * (1.0 - H / KNOCK_S))
    gap.step(way * 0.002, 0.0, -way, 2.0 * KNOCK_S)
    assert gap.pushes(0.0) == 0.0


def test_a_load_that_coasts_comes_to_rest() -> None:
    """Friction ends its motion and does not turn it."""
    gap = pushed(1.0, 100.0)
    for _ in range(20):
        gap.step(0.005, 0.0, -200.0, H)
    assert gap.load == pytest.approx(0.4e-3 + 0.3e-3 + 0.2e-3 + 0.1e-3)
    assert gap.pushes(1.0) - gap.pushes(0.0) == pytest.approx(0.4), "it moves the motor alone"
