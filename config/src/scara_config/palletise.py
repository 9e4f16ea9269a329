"""The work of the cell, from palletise.yaml: parts, stands, pallet, gripper.

Plain data and where things are; SI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from scara_config.loader import ConfigError, Section, load
from scara_config.profile import locate
from scara_config.quantities import CoordinateMm, ExtentMm, Force, PalletCount, SpeedPercent

Point = tuple[CoordinateMm, CoordinateMm]
MM = 1e-3
FILE = "palletise.yaml"


class Parts(Section, frozen=True):
    """One kind of part: a disc."""

    diameter_mm: ExtentMm
    height_mm: ExtentMm
    mass_kg: Annotated[float, Meta(gt=0.0, le=6.0)]
    friction: Annotated[float, Meta(gt=0.0, le=2.0)]

    @property
    def radius(self) -> float:
        """[m]."""
        return 0.5 * self.diameter_mm * MM

    @property
    def height(self) -> float:
        """[m]."""
        return self.height_mm * MM


class Table(Section, frozen=True):
    """The rotary table with its stands: what turns it, and the link that is its disc."""

    joint: str
    link: str
    axis_mm: Point
    top_mm: CoordinateMm
    radius_mm: ExtentMm
    stands_mm: Annotated[dict[str, Point], Meta(min_length=1)]
    stand_top_mm: CoordinateMm
    stand_radius_mm: ExtentMm
    places_mm: Annotated[list[Point], Meta(min_length=1)]
    station_deg: Annotated[float, Meta(ge=-180.0, le=180.0)]

    def turned(self, point_mm: Point, angle: float) -> tuple[float, float]:
        """Return where a point of the table at 0 is at ``angle`` [rad]: x, y [m]."""
        x, y = (point_mm[0] - self.axis_mm[0]) * MM, (point_mm[1] - self.axis_mm[1]) * MM
        c, s = math.cos(angle), math.sin(angle)
        return self.axis_mm[0] * MM + c * x - s * y, self.axis_mm[1] * MM + s * x + c * y

    def angle_of(self, stand: str) -> float:
        """Return the table's position that brings ``stand`` to the station [rad], in (-pi, pi]."""
        x, y = self.stands_mm[stand]
        angle = math.radians(self.station_deg) - math.atan2(
            y - self.axis_mm[1], x - self.axis_mm[0]
        )
        return math.pi - (math.pi - angle) % (2.0 * math.pi)


class Pallet(Section, frozen=True):
    """The pallet and its pattern."""

    middle_mm: Point
    top_mm: CoordinateMm
    size_mm: tuple[ExtentMm, ExtentMm]
    rows: PalletCount
    columns: PalletCount
    pitch_mm: ExtentMm

    def places(self) -> list[tuple[float, float]]:
        """Return the middle of each place, row by row: x, y [m]."""
        x0 = self.middle_mm[0] - 0.5 * (self.columns - 1) * self.pitch_mm
        y0 = self.middle_mm[1] - 0.5 * (self.rows - 1) * self.pitch_mm
        return [
            ((x0 + column * self.pitch_mm) * MM, (y0 + row * self.pitch_mm) * MM)
            for row in range(self.rows)
            for column in range(self.columns)
        ]


class Dock(msgspec.Struct, frozen=True):
    """Where a vehicle stands: its middle in base_link [m], and how it is turned [rad]."""

    x: float
    y: float
    turn: float

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the vehicle is in base_link; both from its middle [m]."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return self.x + c * x - s * y, self.y + s * x + c * y

    def of(self, x: float, y: float) -> tuple[float, float]:
        """Return which point of the vehicle is at a place in base_link: the inverse of ``at``."""
        c, s, dx, dy = math.cos(self.turn), math.sin(self.turn), x - self.x, y - self.y
        return c * dx + s * dy, c * dy - s * dx


class Vehicle(Section, frozen=True):
    """A vehicle that brings a pallet of the same kind, and how well it docks and is seen."""

    middle_mm: Point
    off_mm: Annotated[float, Meta(ge=0.0, le=50.0)]
    off_deg: Annotated[float, Meta(ge=0.0, le=10.0)]
    frame: Annotated[int, Meta(ge=1, le=9)]
    marks_mm: tuple[Point, Point, Point]
    seen_mm: Annotated[float, Meta(ge=0.0, le=5.0)]

    def dock(self, off: Sequence[float] = (0.0, 0.0, 0.0)) -> Dock:
        """Return where it stands.

        Args:
            off: Along x, along y and turned, each as a share -1..1 of what it is off at most.
        """
        x, y = (m + share * self.off_mm for m, share in zip(self.middle_mm, off))
        return Dock(x * MM, y * MM, math.radians(off[2] * self.off_deg))

    def seen(self, dock: Dock, noise: Sequence[float] = (0.0,) * 6) -> list[tuple[float, float]]:
        """Return where its three marks are seen: origin, along x, along y; in base_link [m].

        Args:
            dock: Where it stands.
            noise: x and y of each mark, in standard deviations.
        """
        pairs = zip(self.marks_mm, noise[::2], noise[1::2])
        step = self.seen_mm * MM
        at = [(dock.at(x * MM, y * MM), dx * step, dy * step) for (x, y), dx, dy in pairs]
        return [(x + dx, y + dy) for (x, y), dx, dy in at]


class Gripper(Section, frozen=True):
    """The suction gripper at the tool's origin."""

    reach_mm: ExtentMm
    offset_mm: ExtentMm
    holding_force_n: Force
    stiffness_n_mm: Force
    vacuum_ms: Annotated[float, Meta(ge=0.0, le=5_000.0)]
    release_ms: Annotated[float, Meta(ge=0.0, le=5_000.0)]
    answer_ms: Annotated[float, Meta(ge=10.0, le=10_000.0)]


class Watch(Section, frozen=True):
    """What counts as dropped, and as a collision."""

    drop_mm: ExtentMm
    press_n: Force
    touch_n: Force


class Task(Section, frozen=True):
    """How the parts are carried, and how well."""

    gap_mm: ExtentMm
    clearance_mm: ExtentMm
    travel_mm: CoordinateMm
    near_mm: ExtentMm
    tolerance_mm: ExtentMm
    speed_percent: SpeedPercent
    lower_percent: SpeedPercent
    approach_percent: SpeedPercent
    dwell_s: Annotated[float, Meta(ge=0.0, le=10.0)]
    placed_s: Annotated[float, Meta(gt=0.0, le=10.0)]


class Start(msgspec.Struct, frozen=True):
    """Where a part begins: the middle of its underside [m], with the table at 0."""

    name: str
    stand: str
    x: float
    y: float
    z: float


class Palletise(Section, frozen=True):
    """The file palletise.yaml."""

    parts: Parts
    table: Table
    pallet: Pallet
    floor_mm: CoordinateMm
    gripper: Gripper
    watch: Watch
    task: Task
    vehicle: Vehicle | None = None

    def starts(self) -> list[Start]:
        """Return all parts, ``part_1`` first: stand by stand."""
        table = self.table
        found: list[Start] = []
        for stand, (x, y) in table.stands_mm.items():
            for dx, dy in table.places_mm:
                name = f"part_{len(found) + 1}"
                found.append(
                    Start(name, stand, (x + dx) * MM, (y + dy) * MM, table.stand_top_mm * MM)
                )
        return found

    def picks(self) -> list[tuple[str, str, float, tuple[float, float]]]:
        """Return each part's name, stand, table position [rad] and place: x, y [m]."""
        table = self.table
        return [
            (start.name, start.stand, angle, table.turned((start.x / MM, start.y / MM), angle))
            for start in self.starts()
            for angle in [table.angle_of(start.stand)]
        ]

    @property
    def give(self) -> float:
        """How far the bellows may be compressed: harder than ``press_n`` is a collision [m]."""
        # [N] by [N/mm] are [mm].
        return self.watch.press_n / self.gripper.stiffness_n_mm * MM

    @property
    def pick_height(self) -> float:
        """Height of the tool at which it grips [m]."""
        return (self.table.stand_top_mm + self.parts.height_mm + self.task.gap_mm) * MM

    @property
    def place_height(self) -> float:
        """Height of the tool at which it lets go [m]."""
        return (
            self.pallet.top_mm + self.parts.height_mm + self.task.gap_mm + self.task.clearance_mm
        ) * MM


def find_palletise(directory: Path | str | None = None) -> Palletise | None:
    """Read palletise.yaml as :func:`load_palletise` does.

    None if the chosen robot has no such file: no parts, no gripper.

    Raises:
        ConfigError: The file is wrong.
    """
    return load_palletise(directory) if locate(FILE, directory).exists() else None


def load_palletise(directory: Path | str | None = None) -> Palletise:
    """Read palletise.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a part overhangs its stand, or there are more
            parts than places.
    """
    path = locate(FILE, directory)
    work = load(path, Palletise)
    for index, (x, y) in enumerate(work.table.places_mm):
        reach = math.hypot(x, y) + 0.5 * work.parts.diameter_mm
        if reach > work.table.stand_radius_mm:
            raise ConfigError(
                f"{path}: table.places_mm[{index}] = {[x, y]}: a part reaches {reach:.2f} mm "
                f"from the middle, the stand {work.table.stand_radius_mm:g} mm"
            )
    places, parts = len(work.pallet.places()), len(work.starts())
    if parts > places:
        raise ConfigError(
            f"{path}: pallet.rows, columns = {work.pallet.rows}, {work.pallet.columns}: "
            f"{parts} parts"
        )
    return work
