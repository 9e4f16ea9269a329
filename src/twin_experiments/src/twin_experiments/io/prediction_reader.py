"""What was predicted of motions and what happened, from a bag."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cell_recorder.io.reading.bag_reader import Bag

from twin_experiments.predictions import Both, Foretold

TOPIC = "what_if/outcomes"


def read_predictions(bag: Bag) -> tuple[Foretold, ...]:
    """Return the motions that were judged and have ended, in order; an older bag has none.

    Raises:
        BagError: A message cannot be read.
    """
    return tuple(_foretold(at - bag.start, said) for at, said in bag.messages(TOPIC))


def _foretold(at: float, said: Any) -> Foretold:
    """Convert a scara_msgs/MotionOutcome."""
    return Foretold(
        at,
        said.what,
        said.end,
        Both(said.time_predicted, said.time_measured),
        Both(said.way_predicted, said.way_measured),
        Both(_most(said.effort_predicted), _most(said.effort_measured)),
        said.drift,
    )


def _most(efforts: Sequence[float]) -> float | None:
    """Return the largest effort of all joints; None if none was heard."""
    return float(max(efforts)) if len(efforts) else None
