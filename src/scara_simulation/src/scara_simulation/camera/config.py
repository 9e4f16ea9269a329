"""What camera.yaml may hold, and parameters that stand above it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta
from scara_config import ConfigError, load, locate
from scara_config.loader import convert
from scara_config.quantities import CoordinateM

from scara_simulation.camera.optics import CameraPose, Optics

Pixels = Annotated[int, Meta(ge=16, le=4096)]
Colour = Annotated[int, Meta(ge=0, le=255)]
PARAMETERS = (
    "width_px",
    "height_px",
    "frame_rate_hz",
    "field_of_view_deg",
    "position_m",
    "look_at_m",
)


class CameraConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The camera; keys as in camera.yaml."""

    width_px: Pixels
    height_px: Pixels
    frame_rate_hz: Annotated[float, Meta(ge=0.1, le=60.0)]
    field_of_view_deg: Annotated[float, Meta(ge=5.0, le=120.0)]
    position_m: tuple[CoordinateM, CoordinateM, CoordinateM]
    look_at_m: tuple[CoordinateM, CoordinateM, CoordinateM]
    up: tuple[CoordinateM, CoordinateM, CoordinateM]
    near_m: Annotated[float, Meta(gt=0.0, le=10.0)]
    far_m: Annotated[float, Meta(gt=0.0, le=1000.0)]
    shadows: bool
    light: tuple[CoordinateM, CoordinateM, CoordinateM]
    background: tuple[Colour, Colour, Colour]
    round_edges: Annotated[int, Meta(ge=8, le=256)]
    niceness: Annotated[int, Meta(ge=0, le=19)]

    @property
    def optics(self) -> Optics:
        """Return the projection."""
        return Optics(
            self.width_px,
            self.height_px,
            float(np.radians(self.field_of_view_deg)),
            self.near_m,
            self.far_m,
        )

    @property
    def pose(self) -> CameraPose:
        """Return where it stands and looks."""
        return CameraPose(self.position_m, self.look_at_m, self.up)


def load_camera(
    directory: Path | str | None = None, parameters: Mapping[str, Any] | None = None
) -> CameraConfig:
    """Read camera.yaml of ``directory`` (default: the package scara_config).

    Args:
        directory: Folder.
        parameters: Values of ``PARAMETERS`` by name that stand above the file's.

    Raises:
        ConfigError: The file is missing, a value does not fit, or the camera looks nowhere.
    """
    path = locate("camera.yaml", directory)
    config, source = load(path, CameraConfig), str(path)
    if parameters:
        unknown = sorted(set(parameters) - set(PARAMETERS))
        if unknown:
            raise ConfigError(
                f"camera: ~{unknown[0]}: no such parameter; there are {', '.join(PARAMETERS)}"
            )
        source = "camera: parameters over camera.yaml"
        # Judged as one file: the same limits bind parameters.
        config = convert({**msgspec.to_builtins(config), **parameters}, CameraConfig, source)
    if not config.near_m < config.far_m:
        raise ConfigError(
            f"{source}: near_m = {config.near_m:g}: must be below far_m = {config.far_m:g}"
        )
    if not config.pose.is_defined:
        raise ConfigError(
            f"{source}: look_at_m = {list(config.look_at_m)}: from position_m = "
            f"{list(config.position_m)} "
            f"this must be a direction, and not that of up = {list(config.up)}"
        )
    return config
