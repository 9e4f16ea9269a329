"""The typed content of experiments.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

import msgspec
import numpy as np
from cell_recorder.recording.recording import RecorderSettings
from msgspec import Meta
from scara_config import ConfigError, Robot, Section, load, locate
from scara_config.quantities import DwellSeconds, SharePercent, SpeedPercent

from twin_experiments.metrics.errors import MetricsSettings

Deadline = Annotated[float, Meta(gt=0.0, le=3600.0)]
Visits = Annotated[list[str], Meta(min_length=2)]


class RealLeads(Section, frozen=True, kw_only=True, tag_field="leader", tag="real"):
    """The robot's own program moves first."""

    program: Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]*\Z")]
    override_percent: SpeedPercent
    visits: Visits
    leader: ClassVar[Literal["real", "twin"]] = "real"


class TwinLeads(Section, frozen=True, kw_only=True, tag_field="leader", tag="twin"):
    """The twin is sent to one position after the other."""

    speed_percent: SpeedPercent
    dwell_s: DwellSeconds
    visits: Visits
    leader: ClassVar[Literal["real", "twin"]] = "twin"


class RealPalletises(Section, frozen=True, kw_only=True, tag_field="leader", tag="real"):
    """The robot's own program carries the parts."""

    program: Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]*\Z")]
    override_percent: SpeedPercent
    visits: ClassVar[tuple[str, ...]] = ()
    leader: ClassVar[Literal["real", "twin"]] = "real"


class TwinPalletises(Section, frozen=True, kw_only=True, tag_field="leader", tag="twin"):
    """The twin carries the parts; heights and speeds are in palletise.yaml."""

    visits: ClassVar[tuple[str, ...]] = ()
    leader: ClassVar[Literal["real", "twin"]] = "twin"


class Unmarked(Section, frozen=True, kw_only=True):
    """A recording without marks: nobody said what should be visited."""

    leader: Literal["real", "twin"]
    visits: ClassVar[tuple[str, ...]] = ()


Palletising = RealPalletises | TwinPalletises
Experiment = RealLeads | TwinLeads | Palletising
Judged = Experiment | Unmarked
PALLETISE = "palletise"
"""Name that stands for all of ``palletising``."""


class MetricsSection(Section, frozen=True, kw_only=True):
    """What counts as moving, as a hole, as a rest.

    See :class:`twin_experiments.metrics.errors.MetricsSettings`.
    """

    rate_hz: Annotated[float, Meta(ge=100.0, le=10_000.0)]
    longest_gap_s: Annotated[float, Meta(ge=0.02, le=1.0)]
    moving_speed_percent: SharePercent
    rest_s: DwellSeconds
    rest_margin_s: DwellSeconds
    set_position_radius_mm: Annotated[float, Meta(gt=0.0, le=1000.0)]
    max_lag_s: Annotated[float, Meta(gt=0.0, le=2.0)]
    shortest_move_mm: Annotated[float, Meta(ge=0.0, le=1000.0)]


class Limits(Section, frozen=True, kw_only=True):
    """What a run must keep to pass."""

    path_error_percent: SharePercent
    positioning_error_percent: SharePercent
    excluded_percent: SharePercent


class PaperFigures(Section, frozen=True, kw_only=True):
    """The article's results."""

    path_error_percent: SharePercent
    positioning_error_percent: SharePercent


class Deadlines(Section, frozen=True, kw_only=True):
    """Every wait of a run ends."""

    cell: Deadline
    still: Deadline
    move: Deadline
    program: Deadline
    service: Deadline


class ExperimentsFile(Section, frozen=True, kw_only=True):
    """Everything in experiments.yaml."""

    recorder: RecorderSettings
    experiments: Annotated[dict[str, RealLeads | TwinLeads], Meta(min_length=1)]
    palletising: dict[str, Palletising] = msgspec.field(default_factory=dict)
    metrics: MetricsSection
    limits: Limits
    paper: PaperFigures
    deadlines_s: Deadlines

    @property
    def known(self) -> dict[str, Experiment]:
        """All experiments by name."""
        return {**self.experiments, **self.palletising}

    def check(self, robot: Robot, source: str) -> None:
        """Raise ConfigError unless ``robot`` knows every visited position; ``source`` is named."""
        for name, experiment in self.experiments.items():
            unknown = sorted(set(experiment.visits) - set(robot.positions_m))
            if unknown:
                raise ConfigError(
                    f"{source}: experiments.{name}.visits = {', '.join(unknown)}: "
                    f"Expected one of {', '.join(robot.positions_m)}"
                )

    def select(self, names: list[str]) -> dict[str, Experiment]:
        """Return the experiments called ``names`` in that order, the article's if there is none.

        ``palletise`` stands for both.

        Raises:
            ConfigError: A name is unknown; the text lists those that exist.
        """
        wanted = [
            each for name in names for each in (self.palletising if name == PALLETISE else (name,))
        ]
        for name in wanted:
            if name not in self.known:
                raise ConfigError(
                    f"unknown experiment {name!r}: experiments.yaml has "
                    f"{', '.join((*self.known, PALLETISE))}"
                )
        return {name: self.known[name] for name in wanted or self.experiments}


def metrics_settings(section: MetricsSection, robot: Robot) -> MetricsSettings:
    """Build the settings of the errors for the joints of ``robot`` that move the twin's tool."""
    fraction = section.moving_speed_percent / 100.0
    fields = {
        name: getattr(section, name)
        for name in section.__struct_fields__
        if name != "moving_speed_percent"
    }
    # Of the arm alone: the table does not move the tool.
    moving_speeds = np.array([joint.velocity * fraction for joint in robot.arm_joints])
    return MetricsSettings(reach_mm=robot.reach_mm, moving_speeds=moving_speeds, **fields)


def load_experiments(robot: Robot, directory: Path | str | None = None) -> ExperimentsFile:
    """Read experiments.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, or an experiment visits an unknown position.
    """
    path = locate("experiments.yaml", directory)
    config = load(path, ExperimentsFile)
    config.check(robot, str(path))
    return config
