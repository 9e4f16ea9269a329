"""What a part comes to lie on: each face to its edges, as high as it is, turned, come and gone."""

from __future__ import annotations

import pytest
from fanuc_emulator.gripping.surroundings import VEHICLE, Surface, WorkSurfaces
from harness.workspace import ROOT
from msgspec.structs import replace
from scara_config.palletise import MM, Dock, load_palletise

SHIPPED = load_palletise(ROOT / "config")
WORK = replace(
    SHIPPED,
    pallet=replace(SHIPPED.pallet, size_mm=(240.0, 180.0)),
    table=replace(SHIPPED.table, axis_mm=(SHIPPED.table.axis_mm[0], 8.0)),
)
"""With a pallet that is longer one way than the other, and a table beside the robot's x axis."""
TABLE, PALLET = WORK.table, WORK.pallet
TURNED = 0.7
"""The table's position [rad]: no stand is where it is at 0."""
A_LITTLE = 1e-4
"""Inside an edge or outside of it [m]."""
WAYS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
HERE = Dock(PALLET.middle_mm[0] * MM, PALLET.middle_mm[1] * MM, 0.0)
DOCKED = Dock(0.06, 0.44, 0.3)
TURNING = [(name, place, TABLE.stand_radius_mm) for name, place in TABLE.stands_mm.items()]


def below(around: WorkSurfaces, x: float, y: float, height: float = 1.0) -> str:
    """Return what a part that is let go there comes to lie on."""
    return around.below(x, y, height, TURNED).name


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("name", "place_mm", "radius_mm"), [(TABLE.link, TABLE.axis_mm, TABLE.radius_mm), *TURNING]
)
def test_table_and_stands_carry_what_lies_within_their_radius(
    name: str, place_mm: tuple[float, float], radius_mm: float, way: tuple[float, float]
) -> None:
    """The stands where the table has turned them; a part beside one falls on the table."""
    around, middle = WorkSurfaces(WORK), TABLE.turned(place_mm, TURNED)
    beside = "floor" if name == TABLE.link else TABLE.link
    for off, found in ((-A_LITTLE, name), (A_LITTLE, beside)):
        assert (
            below(around, *(m + (radius_mm * MM + off) * w for m, w in zip(middle, way))) == found
        )


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("name", "stands"), [("pallet", HERE), (VEHICLE, DOCKED)])
def test_a_pallet_carries_what_lies_within_its_half_lengths(
    name: str, stands: Dock, way: tuple[float, float]
) -> None:
    """One that came with a vehicle as that is turned."""
    around = WorkSurfaces(WORK)
    around.dock(DOCKED)
    edge = [0.5 * length * MM for length in PALLET.size_mm]
    for off, found in ((-A_LITTLE, name), (A_LITTLE, "floor")):
        assert below(around, *stands.at(*((e + off) * w for e, w in zip(edge, way)))) == found


def test_a_vehicle_takes_its_pallet_along() -> None:
    """The next one stands elsewhere, and there is one at most; the robot's own pallet stays."""
    around, other = WorkSurfaces(WORK), Dock(0.06, 0.9, 0.0)
    seen = []
    for stands in (None, DOCKED, other, None):
        around.dock(stands)
        seen.append([below(around, place.x, place.y) for place in (HERE, DOCKED, other)])
    floor = "floor"
    assert seen == [
        ["pallet", floor, floor],
        ["pallet", VEHICLE, floor],
        ["pallet", floor, VEHICLE],
        ["pallet", floor, floor],
    ]


def test_a_part_lies_on_the_highest_face_that_is_not_above_it() -> None:
    """A stand, then the table under it, then the floor, which is under everything."""
    around = WorkSurfaces(WORK)
    x, y = TABLE.turned(next(iter(TABLE.stands_mm.values())), TURNED)
    heights = {"stand_1": TABLE.stand_top_mm, TABLE.link: TABLE.top_mm, "floor": WORK.floor_mm}
    names = [*heights, "floor"]
    for (name, height_mm), lower in zip(heights.items(), names[1:]):
        assert below(around, x, y, height_mm * MM) == name
        assert below(around, x, y, height_mm * MM - A_LITTLE) == lower
        assert around.below(x, y, height_mm * MM, TURNED).height == height_mm * MM
    assert around.below(HERE.x, HERE.y, 1.0, TURNED).height == PALLET.top_mm * MM
    assert around.top == max(TABLE.stand_top_mm, PALLET.top_mm) * MM


@pytest.mark.parametrize(("away", "touches"), [(0.059, True), (0.061, False)])
def test_a_disc_is_over_a_round_face_as_far_as_both_radii_reach(away: float, touches: bool) -> None:
    """50 mm of the face and 10 mm of the disc; its middle has to be over the face itself."""
    face = Surface("stand", 0.0, (0.3, 0.2), radius=0.05)
    x, y = 0.3 - 0.6 * away, 0.2 + 0.8 * away
    assert face.carries(x, y, 0.01) is touches
    assert not face.carries(x, y)
