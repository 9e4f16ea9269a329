"""A comparison as data: comparison.json, and the rows of its tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from twin_experiments.metrics.tracks import Mechanism
from twin_experiments.report.charts import least_distance
from twin_experiments.report.document import rounded_tree

from twin_analysis.compare.differences import PairDeviation, RunDifference
from twin_analysis.compare.fidelity import Fidelity

PAIR_HEADINGS = (
    "recording",
    "leader",
    "max",
    "rms",
    "lag",
    "matched",
    "of moving",
    "matched apart",
    "gaps",
    "largest joint deviation",
)
RUN_HEADINGS = (
    "recording",
    "side",
    "same time: rms",
    "max",
    "off the path: rms",
    "max",
    "path longer by",
    "matched",
    "gaps",
)
SAME = "less than can be told apart here"


@dataclass(frozen=True)
class ExperimentComparison:
    """All recordings of one experiment; ``reasons`` say what could not be compared.

    The others are held against the one with the label ``first``.
    """

    name: str
    first: str
    pairs: tuple[PairDeviation, ...]
    runs: tuple[RunDifference, ...]
    reasons: tuple[str, ...]


def comparison_document(
    mechanism: Mechanism, labels: dict[str, str], compared: Sequence[ExperimentComparison]
) -> dict[str, Any]:
    """Return the content of comparison.json.

    Args:
        mechanism: What was compared.
        labels: Label of each recording to its path.
        compared: Each experiment; its ``first`` is what the others are held against.
    """
    document = {
        "recordings": labels,
        "joints": list(mechanism.names),
        "unit": mechanism.place_unit,
        "experiments": [
            {
                "name": experiment.name,
                "first": experiment.first or None,
                "real_twin": [_pair(pair) for pair in experiment.pairs],
                "against_first": [_run(run) for run in experiment.runs],
                "reasons": list(experiment.reasons),
            }
            for experiment in compared
        ],
    }
    rounded: dict[str, Any] = rounded_tree(document)
    return rounded


def _pair(pair: PairDeviation) -> dict[str, Any]:
    """Return real against twin of one recording."""
    entry: dict[str, Any] = {"recording": pair.track.label, "leader": pair.track.leader}
    if pair.comparison is not None:
        path, after = pair.comparison.path, pair.comparison.path_after_lag
        entry |= {
            "path_error_max_mm": path.max_mm,
            "path_error_max_percent": path.max_percent,
            "path_error_rms_mm": path.rms_mm,
            "path_error_max_after_lag_mm": None if after is None else after.max_mm,
            # Between the tools alone: set positions are the report's.
            "rest_apart_max_mm": pair.comparison.positioning_max_mm,
        }
    return entry | {
        "lag_s": pair.lag_s,
        "joints": {
            joint.name: {"unit": joint.unit, "rms": joint.rms, "max": joint.max}
            for joint in pair.joints
        },
        "fidelity": {**_fidelity(pair.fidelity), "mean_distance_mm": pair.mean_distance_mm},
        "excluded_percent": pair.excluded_percent,
        "gaps": [
            {"side": gap.side, "start_s": gap.start - pair.begun, "duration_s": gap.duration}
            for gap in pair.gaps
        ],
        "notes": list(pair.track.notes),
    }


def _run(run: RunDifference) -> dict[str, Any]:
    """Return one side of a recording against the first recording."""
    return {
        "recording": run.label,
        "side": run.side,
        "same_time_rms": run.time_rms,
        "same_time_max": run.time_max,
        "off_path_rms": run.path_rms,
        "off_path_max": run.path_max,
        "path_longer_percent": run.length_percent,
        "fidelity": _fidelity(run.fidelity),
    }


def _fidelity(fidelity: Fidelity) -> dict[str, Any]:
    """Return a trace alignment."""
    return {
        "snapshots": list(fidelity.snapshots),
        "matched_percent": fidelity.matched_percent,
        "matched_moving_percent": fidelity.moving_percent,
        "mean_distance_of_accepted": fidelity.mean_distance,
        "gaps": fidelity.gaps,
        "longest_gap_snapshots": fidelity.longest_gap,
        "mean_shift_snapshots": fidelity.mean_shift,
    }


def pair_rows(experiment: ExperimentComparison) -> list[tuple[str, ...]]:
    """Return one row of text for each recording, cells as in ``PAIR_HEADINGS``."""
    return [_pair_row(pair) for pair in experiment.pairs]


def _pair_row(pair: PairDeviation) -> tuple[str, ...]:
    tool, fidelity = pair.comparison, pair.fidelity
    # Across units: 0.1 deg is about 1 mm at the end of an outstretched arm.
    worst = max(pair.joints, key=lambda joint: joint.max / (1.0 if joint.unit == "mm" else 0.1))
    # How far matched snapshots are apart.
    apart = "-"
    if pair.mean_distance_mm is not None:
        apart = f"{pair.mean_distance_mm:.3f} mm"
    elif fidelity.mean_distance is not None:
        apart = f"{100.0 * fidelity.mean_distance:.1f} % of accepted"
    return (
        pair.track.label,
        pair.track.leader,
        "-" if tool is None else f"{tool.path.max_mm:.2f} mm  {tool.path.max_percent:.3f} %",
        "-" if tool is None else f"{tool.path.rms_mm:.2f} mm",
        "-" if pair.lag_s is None else f"{1e3 * pair.lag_s:+.1f} ms",
        f"{fidelity.matched_percent:.1f} %",
        "-" if fidelity.moving_percent is None else f"{fidelity.moving_percent:.1f} %",
        apart,
        _gaps(fidelity),
        f"{worst.name} {worst.max:.3f} {worst.unit}",
    )


def _gaps(fidelity: Fidelity) -> str:
    """Return number and largest length of gaps."""
    return f"{fidelity.gaps}, longest {fidelity.longest_gap}" if fidelity.gaps else "0"


def run_rows(experiment: ExperimentComparison, unit: str) -> list[tuple[str, ...]]:
    """Return a row of text for each side of each recording but the first.

    The cells are those of ``RUN_HEADINGS``.
    """
    return [
        (
            run.label,
            run.side,
            *(
                f"{value:.3f} {unit}"
                for value in (run.time_rms, run.time_max, run.path_rms, run.path_max)
            ),
            f"{run.length_percent:+.2f} %",
            f"{run.fidelity.matched_percent:.1f} %",
            _gaps(run.fidelity),
        )
        for run in experiment.runs
    ]


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
        found.append(
            f"{experiment.name}: beside {experiment.first}, the {run.side} of {run.label} left its "
            f"path by at most {_length(run.path_max, unit)}."
        )
    return found


def _length(value: float, unit: str) -> str:
    """Return a length with the digits that mean something."""
    if value < 0.01 * least_distance(unit):
        return f"{value:.0e} {unit} ({SAME})"
    return f"{value:.3f} {unit}" if unit == "mm" else f"{value:.4f} {unit}"
