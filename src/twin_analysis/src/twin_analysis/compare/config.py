"""The typed content of comparison.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from scara_config import Joint, load, locate
from scara_config.quantities import CoarseTolerance
from twin_experiments.metrics.series import Array


class Accepted(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Differences within which two snapshots may match."""

    deg: CoarseTolerance
    mm: CoarseTolerance


class ComparisonFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything in comparison.yaml."""

    snapshots_hz: Annotated[float, Meta(ge=1.0, le=1000.0)]
    accepted: Accepted
    gap_penalty: Annotated[float, Meta(ge=0.0, le=1.0)]
    longest_shift_s: Annotated[float, Meta(gt=0.0, le=60.0)]
    path_points: Annotated[int, Meta(ge=10, le=100_000)]

    def accepted_of(self, joints: list[Joint]) -> Array:
        """Return the accepted difference of each joint, shape ``(n,)``, SI."""
        return np.array(
            [
                (self.accepted.deg if joint.unit == "deg" else self.accepted.mm) * joint.scale
                for joint in joints
            ]
        )


def load_comparison(directory: Path | str | None = None) -> ComparisonFile:
    """Read comparison.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong.
    """
    return load(locate("comparison.yaml", directory), ComparisonFile)
