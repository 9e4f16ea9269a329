"""The plant of a recording: how the robot's stand-in behaved, as it said on ``real/plant``.

Only what a report needs is read; whatever else a plant has may change.
"""

from __future__ import annotations

import msgspec

PLANT = "real/plant"
NOT_RECORDED = "not recorded"
Row = tuple[float, float, float, float]


class PlantError(ValueError):
    """The text of ``real/plant`` is not understood; the error names the topic."""


class ScrewGeometry(msgspec.Struct, frozen=True):
    """The arm as it was made: screw axes ``(omega, v)`` by joint, and the tool's home pose."""

    screw_axes: dict[str, tuple[float, float, float, float, float, float]]
    home_pose: tuple[Row, Row, Row, Row]


class ZeroOffset(msgspec.Struct, frozen=True):
    """By how much a joint is further than its encoder says, in the unit of the joint."""

    zero_offset_deg: float = 0.0
    zero_offset_mm: float = 0.0


class RecordedPlant(msgspec.Struct, frozen=True):
    """What a recording says of its plant.

    Attributes:
        name: File name without its ending.
        description: Stands beside each figure.
        payload_kg: What the tool carries.
        geometry: The true geometry; None if it is that of robot.yaml.
        axes: Joint to its zero offset.
    """

    name: str
    description: str
    payload_kg: float
    geometry: ScrewGeometry | None = None
    axes: dict[str, ZeroOffset] = {}

    @property
    def label(self) -> str:
        """Name and description, as they stand beside a figure."""
        return f"{self.name}: {self.description}"


def plant_label(plant: RecordedPlant | None) -> str:
    """Return name and description of a plant, or that it was not recorded."""
    return NOT_RECORDED if plant is None else plant.label


def parse_plant(text: str) -> RecordedPlant:
    """Read the text of ``real/plant``.

    Raises:
        PlantError: It is no JSON, or a key is missing or wrong.
    """
    try:
        return msgspec.json.decode(text, type=RecordedPlant)
    except msgspec.DecodeError as error:
        raise PlantError(f"{PLANT}: {error}") from error
