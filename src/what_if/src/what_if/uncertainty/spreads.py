"""What is not exactly known of a cell: by how much, and who says so."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import NormalDist

import msgspec
import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.world import World

ASSUMED, FITTED = "assumed in what_if.yaml", "fitted to recorded cycles"


class Spread(msgspec.Struct, frozen=True):
    """One number of the cell that is known only so well.

    Attributes:
        key: As :mod:`what_if.uncertainty.varied` takes it; parts and people have one for each.
        words: For people.
        deviation: Standard deviation, in ``unit``.
        unit: mm, deg, percent, ms.
        source: Who says so.
        count: So many numbers are drawn with it.
    """

    key: str
    words: str
    deviation: float
    unit: str
    source: str
    count: int = 1


def spreads_of(world: World) -> tuple[Spread, ...]:
    """Return what is not exactly known of a world; what it does not have is left out.

    What decides most comes first: the first numbers of a drawing are spread most evenly.
    """
    known, law = world.cell.config.uncertainty, world.cell.config.program
    found = []
    if world.cell.work is not None:
        found += [
            Spread("table_mm", "table, x and y", known.table_mm, "mm", ASSUMED, 2),
            Spread("table_turn_deg", "table, turned", known.table_turn_deg, "deg", ASSUMED),
            Spread("pallet_mm", "pallet, x and y", known.pallet_mm, "mm", ASSUMED, 2),
            Spread(
                "part_mm", "each part, x, y", known.part_mm, "mm", ASSUMED, 2 * len(world.parts)
            ),
        ]
    found += [
        Spread(
            "person_mm", "each person, x, y", known.person_mm, "mm", ASSUMED, 2 * len(world.people)
        ),
        Spread("lag_ms", "lag", 1e3 * world.lag.spread, "ms", ASSUMED),
        Spread(
            "fine_ms",
            "rest at each FINE",
            law.fine_spread_ms,
            "ms",
            FITTED if law.fitted else ASSUMED,
        ),
        Spread(
            "acceleration_percent",
            "acceleration of programs",
            law.acceleration_spread_percent,
            "percent",
            ASSUMED,
        ),
        Spread("mass_percent", "masses", known.mass_percent, "percent", ASSUMED),
        Spread("friction_percent", "friction", known.friction_percent, "percent", ASSUMED),
        Spread("payload_percent", "payload", known.payload_percent, "percent", ASSUMED),
    ]
    return tuple(spread for spread in found if spread.count and spread.deviation > 0.0)


def drawn(spreads: Sequence[Spread], worlds: int, rng: np.random.Generator) -> FloatArray:
    """Draw what is different in each world.

    Numbers of normal distributions, spread more evenly than by chance alone (a scrambled Sobol
    sequence): so many worlds say more than as many random ones. The first worlds of a longer
    drawing are those of a shorter one.

    Args:
        spreads: What is not exactly known.
        worlds: So many rows.
        rng: Source of chance; the same drawing from the same state of it.

    Returns:
        Deviations in the spreads' units, shape (worlds, sum of counts).
    """
    from scipy.stats import qmc  # slow to load, and a judge of one world needs none of it

    columns = [spread.deviation for spread in spreads for _ in range(spread.count)]
    if not columns or not worlds:
        return np.zeros((worlds, len(columns)))
    sequence = qmc.Sobol(len(columns), scramble=True, rng=rng)
    # Sobol points are spread evenly only in whole powers of two.
    even = sequence.random_base2(max(worlds - 1, 1).bit_length())[:worlds]
    normal = NormalDist()
    # A scrambled point may be 0, where the inverse is infinite.
    inside = np.clip(even, 1e-9, 1.0 - 1e-9)
    found: FloatArray = np.vectorize(normal.inv_cdf)(inside) * np.array(columns)
    return found
