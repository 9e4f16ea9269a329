"""Where on a way a zone is entered: the first place, whatever the way is cut into."""

from __future__ import annotations

import numpy as np
import pytest
from scara_config import KeepOut
from scara_control.keep_out.zones import heads_into
from what_if.geometry.way import Way
from what_if.world import World
from what_if.zones import first_zone

WALL = KeepOut("wall", (300.0, 200.0, -300.0), (700.0, 220.0, 500.0))
THROUGH = (-0.4, 1.4, -0.4)
"""Angles of joint 1: the stretched arm goes into the wall and comes back out of it."""
INTO = (-0.4, 0.5)
"""It stops in the wall."""
BESIDE = (-0.4, 0.31, -0.4)
"""The tool turns back less than 2 mm before the wall."""


def turning(angles: tuple[float, ...], pieces: int) -> Way:
    """Return turns of joint 1 of the stretched arm, each cut into so many straight pieces."""
    parts = np.linspace(0.0, len(angles) - 1.0, (len(angles) - 1) * pieces + 1)
    knots = np.zeros((len(parts), 4))
    knots[:, 0], knots[:, 2] = np.interp(parts, np.arange(len(angles)), angles), -0.1
    return Way(knots)


@pytest.mark.parametrize("pieces", [1, 2, 3, 5, 8])
@pytest.mark.parametrize(
    ("angles", "margin_mm", "does"),
    [
        (THROUGH, 0.0, "would enter keep-out zone wall"),
        (INTO, 5.0, "would enter keep-out zone wall"),
        (BESIDE, 5.0, "would come nearer than 5 mm to keep-out zone wall"),
    ],
)
def test_a_way_is_free_up_to_the_place_that_is_told(
    world: World, pieces: int, angles: tuple[float, ...], margin_mm: float, does: str
) -> None:
    """A little less of it is free, a little more is refused; who enters does not come near only."""
    way = turning(angles, pieces)
    found = first_zone(world.cell.points[:1], WALL, way, margin_mm)
    assert found is not None
    text, u = found
    assert does in text
    wide = margin_mm if "nearer" in does else 0.0
    zone = KeepOut(
        WALL.name,
        tuple(x - wide for x in WALL.lower_mm),
        tuple(x + wide for x in WALL.upper_mm),
    )
    for place, refused in ((u - 1e-3, False), (u + 1e-3, True)):
        whole = way.knots[: int(place) + 1].tolist()
        end = way.at(np.array([place]))[0].tolist()
        assert (
            bool(heads_into(world.cell.points[:1], [zone], *map(tuple, [*whole, end]))) is refused
        )


def test_a_way_that_keeps_away_or_goes_nowhere_meets_no_zone(world: World) -> None:
    """By more than the margin; a place alone is no way, not even one in the wall."""
    inside = Way(np.array([(0.32, 0.0, -0.1, 0.0)]))
    assert first_zone(world.cell.points[:1], WALL, turning(BESIDE, 3), 1.0) is None
    assert first_zone(world.cell.points[:1], WALL, inside, 5.0) is None
