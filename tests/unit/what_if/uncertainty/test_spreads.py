"""What is not exactly known: how it is drawn, and what a world becomes by it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from what_if.judging import judge
from what_if.motions import JointTarget
from what_if.uncertainty.spreads import ASSUMED, FITTED, Spread, drawn, spreads_of
from what_if.uncertainty.varied import payload_of, varied
from what_if.world import World

MOVE = JointTarget((0.9, 0.4, -0.06, 0.3))
SPREADS = (
    Spread("table_mm", "table", 2.0, "mm", ASSUMED, 2),
    Spread("table_turn_deg", "turn", 1.0, "deg", ASSUMED),
    Spread("part_mm", "parts", 1.0, "mm", ASSUMED, 2),
    Spread("mass_percent", "masses", 5.0, "percent", ASSUMED),
    Spread("friction_percent", "friction", 5.0, "percent", ASSUMED),
    Spread("payload_percent", "payload", 5.0, "percent", ASSUMED),
    Spread("lag_ms", "lag", 5.0, "ms", ASSUMED),
)


def test_numbers_are_drawn_with_their_deviations_and_the_same_again() -> None:
    """A longer drawing begins like a shorter one."""
    rows = drawn(SPREADS, 1000, np.random.default_rng(3))
    assert rows.shape == (1000, 9)
    deviations = [spread.deviation for spread in SPREADS for _ in range(spread.count)]
    assert rows.mean(axis=0) == pytest.approx(np.zeros(9), abs=0.02 * max(deviations))
    assert rows.std(axis=0) == pytest.approx(np.array(deviations), rel=0.03)
    assert np.array_equal(rows[:64], drawn(SPREADS, 64, np.random.default_rng(3)))
    assert not np.array_equal(rows, drawn(SPREADS, 1000, np.random.default_rng(4)))


def test_each_spread_says_where_it_is_from(world: World) -> None:
    """A cell without people has none of theirs; fitted numbers are told from assumed ones."""
    found = {spread.key: spread for spread in spreads_of(world)}
    assert "person_mm" not in found and found["part_mm"].count == 18
    assert {spread.source for spread in found.values()} == {ASSUMED}
    config = world.cell.config
    fitted = type(config.program)(
        **{
            **{f: getattr(config.program, f) for f in config.program.__struct_fields__},
            "fitted": True,
        }
    )
    known = type(config)(
        **{**{f: getattr(config, f) for f in config.__struct_fields__}, "program": fitted}
    )
    found = {s.key: s for s in spreads_of(replace(world, cell=replace(world.cell, config=known)))}
    # Learning fits FINE alone.
    assert [key for key, spread in found.items() if spread.source == FITTED] == ["fine_ms"]


def test_a_row_of_zeros_is_the_world_itself(world: World) -> None:
    """But for the distance at which bodies count as touching."""
    same, before = judge(varied(world, SPREADS, [0.0] * 9), MOVE), judge(world, MOVE)
    assert same.duration_s == before.duration_s
    assert same.clearance is not None and before.clearance is not None
    assert same.clearance.distance_mm == pytest.approx(before.clearance.distance_mm, abs=1e-6)
    assert [use.effort_percent for use in same.joints] == pytest.approx(
        [use.effort_percent for use in before.joints]
    )


def test_table_parts_and_efforts_are_otherwise(world: World) -> None:
    """Stands go with the table, parts with both; efforts follow masses and friction."""
    row = [3.0, -2.0, 0.0, 1.0, 0.5, 10.0, 10.0, 0.0, 7.0]
    other = varied(world, SPREADS, row)
    still = np.zeros((1, len(world.q)))
    before, after = world.cell.tree.poses(still)[0], other.cell.tree.poses(still)[0]
    stand = world.cell.tree.index["stand_1"]
    moved = 1e3 * (after[stand, :3, 3] - before[stand, :3, 3])
    assert moved == pytest.approx([3.0, -2.0, 0.0], abs=1e-9)
    aside = 1e3 * (other.parts[0].pose[:2, 3] - world.parts[0].pose[:2, 3])
    assert aside == pytest.approx([1.0, 0.5])
    q, qdot, qddot = [0.1, 0.2, -0.1, 0.0], [0.5] * 4, [1.0] * 4
    efforts = world.models[False].inverse_dynamics(q, qdot, qddot)
    heavier = other.models[False]
    assert heavier.inverse_dynamics(q, qdot, qddot) == pytest.approx([1.1 * e for e in efforts])
    assert heavier.friction == pytest.approx([1.1 * f for f in world.models[False].friction])
    assert heavier.mass_matrix(q)[0] == pytest.approx(
        [1.1 * m for m in world.models[False].mass_matrix(q)[0]]
    )
    assert other.lag.mean == pytest.approx(world.lag.mean + 0.007)
    turned = varied(world, SPREADS, [0.0, 0.0, 2.0, *row[3:]]).cell.tree.poses(still)[0]
    cosine = float((before[stand, :3, 0] * turned[stand, :3, 0]).sum())
    assert math.degrees(math.acos(cosine)) == pytest.approx(2.0)


def test_a_payload_is_heavier_as_a_whole(world: World) -> None:
    """Mass and inertia by the same share; without one nothing is drawn."""
    assert world.payload is not None
    heavy = replace(world, payload=type(world.payload)(1, "block", 2.0, (0, 0, 0), (1.0, 1.0, 1.0)))
    row = [0.0] * 7 + [10.0, 0.0]
    found = payload_of(heavy, SPREADS, row)
    assert found is not None and found.mass_kg == pytest.approx(2.2)
    assert found.inertia_kg_m2 == pytest.approx((1.1, 1.1, 1.1))
    assert payload_of(replace(world, payload=None), SPREADS, row) is None
