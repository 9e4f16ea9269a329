"""What was recorded, as plain arrays: one clock, seconds since the start of the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from twin_experiments.metrics.pauses import Pause
from twin_experiments.metrics.series import FEWEST_SAMPLES, Array, Motion
from twin_experiments.palletising import Handled
from twin_experiments.report.label.plant import RecordedPlant
from twin_experiments.report.predictions import Foretold

WHOLE = "recording"
"""Name of the one experiment of a recording without marks."""
ENDS_EARLY = "the recording ends before the experiment does"


class RecordError(ValueError):
    """The recording does not hold what is needed; the text names it."""


@dataclass(frozen=True)
class Span:
    """One experiment between its markers [s]; ``finished`` is False if the recording ended first.

    ``repeat`` counts experiments of one name from 1. ``marked`` is False for a recording without
    marks, which counts as one experiment.
    """

    name: str
    start: float
    end: float
    finished: bool
    repeat: int = 1
    marked: bool = True

    @property
    def label(self) -> str:
        """Name, with its number from the second one on."""
        return self.name if self.repeat == 1 else f"{self.name} #{self.repeat}"


@dataclass(frozen=True)
class Age:
    """Age of a topic's content on receipt: times of receipt [s] and ages [s], shape ``(k,)``."""

    received: Array
    age: Array


@dataclass(frozen=True)
class Event:
    """Something said at a time [s]: a decision of the twin controller, or a warning of a node."""

    at: float
    source: str
    text: str


@dataclass(frozen=True)
class Run:
    """All of a bag that the report uses; motions have the columns of ``joint_names``.

    ``configuration`` and its digest are empty if the bag holds none; ``plant`` is None if no
    stand-in said it. ``real_is_truth`` is False where the real side is what the robot reads.
    ``real`` and ``twin`` are in stamp order, columns as ``joint_names``.
    ``clock_half_widths``: times and half widths of the interval that holds the robot's clock [s],
    where the real side is what the robot reads.
    ``leader``: of a recording without marks, the side that the controller named first as the one
    that leads; empty: it named none.
    ``missing`` says what of a damaged bag could not be read.
    """

    path: str
    origin: float
    duration: float
    repaired: bool
    joint_names: tuple[str, ...]
    spans: tuple[Span, ...]
    real: Motion
    twin: Motion
    ages: Mapping[str, Age] = field(default_factory=dict)
    decisions: tuple[Event, ...] = ()
    warnings: tuple[Event, ...] = ()
    configuration: Mapping[str, Any] = field(default_factory=dict)
    topics: Mapping[str, int] = field(default_factory=dict)
    handled: Mapping[str, Handled] = field(default_factory=dict)
    plant: RecordedPlant | None = None
    configuration_digest: str = ""
    pauses: tuple[Pause, ...] = ()
    real_is_truth: bool = True
    predictions: tuple[Foretold, ...] = ()
    missing: tuple[str, ...] = ()
    clock_half_widths: tuple[Array, Array] | None = None
    leader: str = ""


def whole_span(real: Motion, twin: Motion) -> Span:
    """Return a recording without marks as one experiment: from where both sides are known."""
    start = float(max(real.stamps[0], twin.stamps[0]))
    end = float(min(real.stamps[-1], twin.stamps[-1]))
    return Span(WHOLE, start, max(start, end), True, marked=False)


def find_spans(markers: list[tuple[float, str]], end: float) -> tuple[Span, ...]:
    """Pair the markers ``start NAME`` and ``end NAME``.

    Args:
        markers: Time [s] and text, in order.
        end: End of the recording [s]; an experiment without an end marker ends here.

    Raises:
        RecordError: No experiment was started.
    """
    spans: list[Span] = []
    running: tuple[str, float] | None = None
    for at, text in markers:
        word, _, name = text.partition(" ")
        if running is not None:
            spans.append(Span(running[0], running[1], at, word == "end" and name == running[0]))
            running = None
        if word == "start":
            running = (name, at)
    if running is not None:
        spans.append(Span(running[0], running[1], end, False))
    if not spans:
        raise RecordError("no experiment was started: experiment/marker never said `start NAME`")
    return tuple(
        replace(span, repeat=1 + sum(before.name == span.name for before in spans[:number]))
        for number, span in enumerate(spans)
    )


def build_side(side: str, stamps: Array, positions: Array, velocities: Array) -> Motion:
    """Build one side from samples as they came; those that do not go forward are left out.

    Raises:
        RecordError: Less than two samples are left, or a value is not finite.
    """
    later = np.ones(len(stamps), dtype=bool)
    if len(stamps):
        # Later than all before it: a clock that was set back counts again once it has caught up.
        later[1:] = stamps[1:] > np.maximum.accumulate(stamps)[:-1]
    try:
        return Motion(side, stamps[later], positions[later], velocities[later])
    except ValueError as error:
        raise RecordError(str(error)) from error


def cut(motion: Motion, start: float, end: float) -> Motion:
    """Return the samples from ``start`` to ``end`` [s].

    Raises:
        RecordError: Less than two samples lie there.
    """
    inside = (motion.stamps >= start) & (motion.stamps <= end)
    if inside.sum() < FEWEST_SAMPLES:
        raise RecordError(
            f"{motion.side}: {int(inside.sum())} samples between {start:.2f} and {end:.2f} s; "
            f"there are some from {motion.stamps[0]:.2f} to {motion.stamps[-1]:.2f} s"
        )
    return Motion(
        motion.side, motion.stamps[inside], motion.positions[inside], motion.velocities[inside]
    )


def pick(motion: Motion, columns: list[int]) -> Motion:
    """Return the motion of some joints only."""
    return Motion(
        motion.side, motion.stamps, motion.positions[:, columns], motion.velocities[:, columns]
    )
