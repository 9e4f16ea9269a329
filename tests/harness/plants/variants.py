"""What differs from one real robot to another, one change of the ideal stand-in at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
from fanuc_emulator.plant.config import AxisFile, Plant
from scara_config.modbus_map import RING, TABLES
from scara_config.profile import DEFAULT_PLANT
from scara_config.set_up.kit_map import kit_map

from harness.virtual_cell.files import CellFiles, load_files
from harness.workspace import ROOT

Change = Callable[[Plant], Plant]


@dataclass(frozen=True)
class Variant:
    """One robot that was made different.

    Attributes:
        name: For tables.
        change: From the plant of the file to its own.
        plant: The file.
        clock_jitter: Largest error of each stamp of either side [s].
        pauses: The twin controller's process stands still so long [s], one length after the other
            and again from the first.
        first_pause: So long after the beginning for the first time [s].
        pause_every: From one pause to the next [s].
        ahead: The robot takes set points ahead of their time.
        kit: It has what the kit's sheets can make of a delivered robot, and no more.
    """

    name: str
    change: Change = lambda plant: plant
    plant: str = DEFAULT_PLANT
    clock_jitter: float = 0.0
    pauses: tuple[float, ...] = ()
    first_pause: float = 1.0
    pause_every: float = 1.0
    ahead: bool = True
    kit: bool = False

    def files(self, robot: str, folder: Path = ROOT / "config") -> CellFiles:
        """Return the cell of a profile with this robot; its YAML files are in ``folder``."""
        files = load_files(robot, folder, self.plant)
        plant = self.change(files.emulator.plant)
        files = replace(files, emulator=msgspec.structs.replace(files.emulator, plant=plant))
        if self.kit and "imstp" in files.layout.coils:
            return replace(files, layout=kit_map(files.layout))
        return files if self.ahead and not self.kit else without_ring(files)


def without_ring(files: CellFiles) -> CellFiles:
    """Return a cell whose robot takes no set points ahead of their time."""
    tables = {
        table: {k: v for k, v in getattr(files.layout, table).items() if k not in RING}
        for table in TABLES
    }
    return replace(files, layout=msgspec.structs.replace(files.layout, **tables))


def drawn(seed: int, kit: bool) -> Variant:
    """Return a robot of the field plant's kind, drawn by a seed; with the kit's map or the ring."""
    words = "kit" if kit else "ring"
    return Variant(f"draw {seed}, {words}", plant=f"field:{seed}", kit=kit)


def _plant(**fields: Any) -> Change:
    return lambda plant: msgspec.structs.replace(plant, **fields)


def _measuring(**fields: Any) -> Change:
    return lambda plant: msgspec.structs.replace(
        plant, measuring=msgspec.structs.replace(plant.measuring, **fields)
    )


def _axes(change: Callable[[int, AxisFile], Mapping[str, Any]]) -> Change:
    """Change each axis by its place."""

    def changed(plant: Plant) -> Plant:
        axes = {
            name: msgspec.structs.replace(axis, **change(place, axis))
            for place, (name, axis) in enumerate(plant.axes.items())
        }
        return msgspec.structs.replace(plant, axes=axes)

    return changed


def _together(*names: str) -> Change:
    """Make all changes of some variants at once."""

    def changed(plant: Plant) -> Plant:
        for variant in VARIANTS:
            plant = variant.change(plant) if variant.name in names else plant
        return plant

    return changed


def _half_as_strong(_: int, axis: AxisFile) -> dict[str, float]:
    names = ("program", "command", "servo")
    return {
        f"{name}_acceleration_percent": 0.5 * getattr(axis, f"{name}_acceleration_percent")
        for name in names
    }


FREQUENCIES = (14.0, 22.0, 35.0)
IDEAL = Variant("as it is")
FIELD = Variant("field plant", plant="field")
ONE_BY_ONE = (
    Variant("no set points ahead", ahead=False),
    Variant("field plant, no set points ahead", plant="field", ahead=False),
)
VARIANTS = (
    IDEAL,
    # Filters alone: half of their sum is lag, and 3 ms are the servo's.
    Variant("lag 88 ms", _plant(filter_ms=[80, 90])),
    Variant("lag 148 ms", _plant(filter_ms=[140, 150])),
    Variant(
        "lag of each axis its own (14, 22, 35 Hz)",
        _axes(lambda place, _: {"natural_frequency_hz": FREQUENCIES[place % 3]}),
    ),
    Variant("servo without feed-forward", _axes(lambda *_: {"velocity_feedforward": 0.0})),
    Variant("clocks read wrongly by up to 1 ms", clock_jitter=1e-3),
    Variant("clocks read wrongly by up to 5 ms", clock_jitter=5e-3),
    Variant("encoder noise 0.01 deg rms", _measuring(noise_deg=0.01, noise_mm=0.01)),
    Variant("half the acceleration", _axes(_half_as_strong)),
    Variant("readings each 8 ms", _measuring(period_ms=8)),
    Variant("controller pauses for 20 ms each second", pauses=(0.02,)),
    Variant("controller pauses for 50 ms each second", pauses=(0.05,)),
    Variant("controller pauses for 80 ms each second", pauses=(0.08,)),
    FIELD,
    *ONE_BY_ONE,
)
ROUGH_LEADER = Variant(
    "rough readings, clocks and pauses at once",
    _together("encoder noise 0.01 deg rms", "readings each 8 ms"),
    clock_jitter=5e-3,
    pauses=(0.05,),
    # Where it does not brake: nobody can know of that in a pause, and with stamps as rough as these
    # the twin may go on by a fifth of the reach.
    first_pause=1.5,
)
ROUGH_FOLLOWER = Variant(
    "late axes, rough readings and clocks at once",
    _together(
        "lag 148 ms",
        "lag of each axis its own (14, 22, 35 Hz)",
        "servo without feed-forward",
        "readings each 8 ms",
    ),
    clock_jitter=5e-3,
)
"""Robots of which several things are different; ``./cell bench --plants`` tells one at a time."""
