"""Typed content of operator_panel.yaml, and what the page reads from the files of other rooms."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import Robot, load, locate
from scara_config.loader import load_keys
from scara_config.palletise import find_palletise
from scara_config.programs.files import program_files, read_listing
from scara_config.programs.tp.listing import Program
from scara_config.quantities import (
    CoarseTolerance,
    DivergenceMm,
    IdleSeconds,
    PageRateHz,
    PatienceMs,
    Port,
    ServerAddress,
    SharePercent,
    SpeedPercent,
    WaitSeconds,
)

MOST_MM_S = 250.0  # the reduced speed of ISO 10218-1, as a bound for jogs: our choice


class ToolSpeeds(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Speeds of a held tool, along an axis [mm/s] and about one [deg/s]."""

    slow_mm_s: Annotated[float, Meta(gt=0.0, le=MOST_MM_S)]
    fast_mm_s: Annotated[float, Meta(gt=0.0, le=MOST_MM_S)]
    slow_deg_s: Annotated[float, Meta(gt=0.0, le=90.0)]
    fast_deg_s: Annotated[float, Meta(gt=0.0, le=90.0)]


class Jog(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Jogging by a held button."""

    dead_man_ms: Annotated[float, Meta(ge=50.0, le=1000.0)]
    rate_hz: Annotated[float, Meta(ge=5.0, le=100.0)]
    speed_percent: SharePercent
    tool: ToolSpeeds


class Preview(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The step response shown before gains are set."""

    step_deg: CoarseTolerance
    step_mm: CoarseTolerance
    duration_s: Annotated[float, Meta(ge=0.05, le=10.0)]


Origin = Annotated[str, Meta(pattern=r"^https?://[a-z0-9._-]+(:[0-9]{1,5})?\Z")]


class PanelConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """operator_panel.yaml."""

    host: str
    port: Port
    api_origins: list[Origin]
    update_rate_hz: PageRateHz
    silent_ms: Annotated[float, Meta(ge=100.0, le=60000.0)]
    chart_window_s: Annotated[float, Meta(ge=2.0, le=120.0)]
    chart_rate_hz: PageRateHz
    let_go_s: IdleSeconds
    call_timeout_s: WaitSeconds
    program_timeout_s: WaitSeconds
    report_timeout_s: WaitSeconds
    jog: Jog
    preview: Preview


class Surroundings(msgspec.Struct, frozen=True):
    """What the page shows or respects of the other rooms' files.

    Attributes:
        real: The real robot's address, for the pendant.
        keep_s: Who holds control and gives no sign of life for so long loses it [s].
        alarm_mm: So far apart the tools raise an alarm, while a side leads and at rest.
        home_percent: Program speed of HOME.
        jog_limit_percent: What joint_vel_controller accepts, percent of the joint's speed.
        positions: Named tool positions (x, y, z) [m].
        programs: The real robot's own, by name.
        has_parts: Whether there are parts that can be put back.
        folder: With all YAML files; None: the package scara_config.
    """

    real: ServerAddress
    keep_s: float
    alarm_mm: tuple[float, float]
    home_percent: float
    jog_limit_percent: float
    positions: dict[str, tuple[float, float, float]]
    programs: tuple[Program, ...]
    has_parts: bool = False
    folder: Path | None = None


def load_panel(directory: Path | str | None = None) -> PanelConfig:
    """Read operator_panel.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("operator_panel.yaml", directory), PanelConfig)


def load_surroundings(robot: Robot, directory: Path | str | None = None) -> Surroundings:
    """Read twin_controller.yaml, motion.yaml and the programs of ``directory``.

    Raises:
        ConfigError: A file is missing, or a value that is needed here does not fit.
    """
    real, keep_ms, delay_mm, rest_mm, home_percent = load_keys(
        locate("twin_controller.yaml", directory),
        {
            "real": ServerAddress,
            "control.keep_ms": PatienceMs,
            "divergence.delay_mm": DivergenceMm,
            "divergence.rest_mm": DivergenceMm,
            "home.speed_percent": SpeedPercent,
        },
    )
    motion = locate("motion.yaml", directory)
    return Surroundings(
        real=real,
        keep_s=keep_ms * 1e-3,
        alarm_mm=(delay_mm, rest_mm),
        home_percent=home_percent,
        jog_limit_percent=load_keys(motion, {"jog.speed_percent": SharePercent})[0],
        positions=robot.positions_m,
        programs=tuple(read_listing(file) for file in program_files(directory).values()),
        has_parts=find_palletise(directory) is not None,
        folder=Path(directory) if directory is not None else None,
    )
