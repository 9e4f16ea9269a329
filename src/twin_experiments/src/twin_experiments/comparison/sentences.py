"""What a comparison found, in plain sentences."""

from __future__ import annotations

from twin_experiments.comparison.document import ExperimentComparison
from twin_experiments.scales import least_distance

SAME = "less than can be told apart here"


def comparison_sentences(experiment: ExperimentComparison, unit: str) -> list[str]:
    """Return a sentence for the pairs of one experiment, and one for runs against the first.

    Args:
        experiment: All its recordings.
        unit: Of the places.
    """
    found = []
    if apart := [pair for pair in experiment.pairs if len(pair.over_time[1])]:
        worst = max(apart, key=lambda pair: float(pair.over_time[1].max()))
        found.append(
            f"{experiment.name}: real and twin were at most "
            f"{_length(float(worst.over_time[1].max()), unit)} apart, in {worst.track.label}."
        )
    if experiment.runs:
        run = max(experiment.runs, key=lambda each: each.path_max)
        first = experiment.pairs[0].track.label
        found.append(
            f"{experiment.name}: beside {first}, the {run.side} of {run.label} left its path by at "
            f"most {_length(run.path_max, unit)}."
        )
    return found


def _length(value: float, unit: str) -> str:
    """Return a length with the digits that mean something."""
    if value < 0.01 * least_distance(unit):
        return f"{value:.0e} {unit} ({SAME})"
    return f"{value:.3f} {unit}" if unit == "mm" else f"{value:.4f} {unit}"
