"""What was learned of a robot is kept beside the user's tokens, for the controller's next start."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config.files.whole_file import write_whole
from scara_config.quantities import SpeedPercent

from twin_controller.core.events import Joints, RealKnown
from twin_controller.core.state import CoreState

_LOG = logging.getLogger("rosout.learned")


class Learned(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file: joints by name, what :class:`RealKnown` says of each and of all."""

    delay_s: dict[str, Annotated[float, Meta(ge=0.0, le=1.0)]]
    smoothing_s2: dict[str, Annotated[float, Meta(ge=0.0, le=0.01)]]
    spread_s: Annotated[float, Meta(ge=0.0, le=1.0)]
    pace_percent: SpeedPercent
    behind_at_percent: SpeedPercent
    noise: Annotated[float, Meta(ge=0.0)]


def learned_file(folder: Path, robot: str, host: str, port: int) -> Path:
    """Return where it is kept: a robot is told from others by its profile and its address."""
    return folder / f"{robot}_{host}_{port}.json"


def read_learned(path: Path, names: Sequence[str], now: float) -> RealKnown | None:
    """Return what earlier starts have learned; None if there is nothing that can be used.

    Args:
        path: Of the file.
        names: The twin's joints.
        now: Monotonic [s].
    """
    try:
        event = event_of(msgspec.json.decode(path.read_bytes(), type=Learned), names, now)
    except FileNotFoundError:
        return None
    # A file of an older version is one that cannot be used, and must not stop a start.
    except (OSError, ValueError) as error:
        _LOG.warning("%s is not used, the robot is measured anew: %r", path, error)
        return None
    _LOG.info("%s: the robot follows %.0f ms late, as learned before", path, 1e3 * max(event.delay))
    return event


def event_of(kept: Learned, names: Sequence[str], now: float) -> RealKnown:
    """Return what is kept as an input of the core.

    Args:
        kept: What earlier starts have learned.
        names: The twin's joints.
        now: Monotonic [s].

    Raises:
        ValueError: It is of a robot with other joints.
    """
    return RealKnown(
        now,
        _row(kept.delay_s, names),
        _row(kept.smoothing_s2, names),
        kept.spread_s,
        kept.pace_percent,
        kept.behind_at_percent,
        kept.noise,
    )


def _row(by_name: dict[str, float], names: Sequence[str]) -> Joints:
    if set(by_name) != set(names):
        raise ValueError(f"its joints are {', '.join(by_name)}, expected {', '.join(names)}")
    return tuple([by_name[name] for name in names])


def learned(state: CoreState, names: Sequence[str]) -> Learned | None:
    """Return what is to be kept; None while this start has not seen the robot follow.

    Args:
        state: The core's.
        names: The twin's joints.
    """
    response = state.follow.response
    if response.at <= 0.0:
        return None
    return Learned(
        dict(zip(names, response.delay, strict=True)),
        dict(zip(names, response.smoothing, strict=True)),
        response.spread,
        response.pace,
        response.behind_at,
        state.sides.real.noise,
    )


def write_learned(path: Path, kept: Learned) -> None:
    """Keep it; what cannot be written is said, and stops nothing."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, msgspec.json.format(msgspec.json.encode(kept)) + b"\n", 0o600)
    except OSError as error:
        _LOG.warning("what was learned of the robot is not kept: %s", error)
