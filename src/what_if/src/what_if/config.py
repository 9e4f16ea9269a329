"""The numbers of what_if.yaml, and those of the twin controller that count here too."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import load, locate
from scara_config.loader import load_keys
from scara_config.quantities import (
    BodyMm,
    ClearanceMm,
    DriftPercent,
    MeasuredDelayMs,
    PlacementMm,
    RestMs,
    SpeedPercent,
    WholePercent,
)
from scara_ros.gate.settings import GateSettings


class ProgramConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the robot runs a program."""

    acceleration_percent: SpeedPercent
    fine_ms: RestMs
    cnt_ms: RestMs
    acceleration_spread_percent: WholePercent
    fine_spread_ms: RestMs
    fitted: bool


class LagConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The lag of a robot that was not measured."""

    mean_ms: MeasuredDelayMs
    spread_ms: Annotated[float, Meta(ge=0.0, le=500.0)]


class UncertaintyConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How well the cell is known: standard deviations."""

    table_mm: PlacementMm
    table_turn_deg: Annotated[float, Meta(ge=0.0, le=10.0)]
    pallet_mm: PlacementMm
    part_mm: PlacementMm
    person_mm: Annotated[float, Meta(ge=0.0, le=1000.0)]
    mass_percent: WholePercent
    friction_percent: WholePercent
    payload_percent: WholePercent


class LearningConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """From when on predictions and what happens are too far apart."""

    motions: Annotated[int, Meta(ge=1, le=1000)]
    time_percent: DriftPercent
    way_percent: DriftPercent
    effort_percent: DriftPercent


class WhatIfConfig(GateSettings, frozen=True, forbid_unknown_fields=True):
    """Everything of what_if.yaml."""

    nearer_mm: BodyMm
    lay_mm: BodyMm
    person_radius_mm: Annotated[float, Meta(ge=50.0, le=2000.0)]
    person_height_mm: Annotated[float, Meta(ge=300.0, le=3000.0)]
    sample_ms: Annotated[float, Meta(ge=0.5, le=50.0)]
    strayed_mm: BodyMm
    program: ProgramConfig
    lag: LagConfig
    uncertainty: UncertaintyConfig
    learning: LearningConfig


def load_what_if(directory: Path | str | None = None) -> WhatIfConfig:
    """Read what_if.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("what_if.yaml", directory), WhatIfConfig)


def load_limits(directory: Path | str | None = None) -> tuple[float, float]:
    """Read what limits a motion in twin_controller.yaml.

    Returns:
        Clearance of keep-out zones [mm], and the cap of every joint's speed [percent].

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    kinds = {"cell.keep_out_clearance_mm": ClearanceMm, "limit.speed_percent": SpeedPercent}
    clearance_mm, cap_percent = load_keys(locate("twin_controller.yaml", directory), kinds)
    return clearance_mm, cap_percent
